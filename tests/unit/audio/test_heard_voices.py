"""What is known of a voice at a moment: the visemes of who speaks, between two messages too, and nothing of who is silent."""

import numpy as np
import pytest

from vistel.audio.heard_voices import HeardVoices
from vistel.audio.opus import FRAME_NS
from vistel.audio.visemes import SPEECH_BEFORE_NS, VISEMES, from_bytes, to_bytes
from vistel.v1.audio_pb2 import Voice

SECOND = 1_000_000_000
SHUT, OPEN = (np.eye(len(VISEMES))[VISEMES.index(name)] for name in ("PP", "aa"))


def message(t_ns: int, visemes: bytes = b"", *, level_db: float = -20.0, talking: bool = True) -> Voice:
    made = Voice(level_db=level_db, talking=talking, visemes=visemes)
    made.header.t_ns = t_ns
    return made


def test_between_two_messages_the_mouth_is_between_them_and_each_tells_of_a_moment_before_it() -> None:
    voices = HeardVoices()
    voices.receive("ann", message(SECOND, to_bytes(SHUT)))
    voices.receive("ann", message(SECOND + FRAME_NS, to_bytes(OPEN)))
    middle = voices.at("ann", SECOND + FRAME_NS // 2)
    assert middle is not None and middle.visemes is not None
    assert np.allclose(middle.visemes, OPEN)  # the newest: it was so 20 ms before its message
    late = HeardVoices()
    late.receive("ann", message(SECOND, to_bytes(SHUT)))
    late.receive("ann", message(SECOND + 2 * SPEECH_BEFORE_NS, to_bytes(OPEN)))
    now = late.at("ann", SECOND)
    assert now is not None and now.visemes is not None
    assert np.allclose(now.visemes, 0.5 * SHUT + 0.5 * OPEN)


def test_who_is_silent_does_not_speak_and_a_voice_that_ends_is_not_held_for_long() -> None:
    voices = HeardVoices()
    assert voices.at("ann", SECOND) is None
    voices.receive("ann", message(SECOND, to_bytes(OPEN)))
    assert voices.at("ann", SECOND - 1) is None  # before anything was said
    assert voices.at("ann", SECOND + FRAME_NS) is not None
    assert voices.at("ann", SECOND + SECOND // 2) is None
    voices.receive("ben", message(SECOND, talking=False))
    assert voices.at("ben", SECOND) is None
    voices.receive("ann", message(2 * SECOND, level_db=-30.0))
    loud = voices.at("ann", 2 * SECOND)
    assert loud is not None and loud.visemes is None and loud.level_db == pytest.approx(-30.0)
    voices.forget("ann")
    assert voices.at("ann", 2 * SECOND) is None


def test_messages_out_of_order_count_once_and_a_voice_may_begin_anew() -> None:
    voices = HeardVoices()
    for t_ns in (20 * SECOND, 20 * SECOND - FRAME_NS, 20 * SECOND):
        voices.receive("ann", message(t_ns, to_bytes(OPEN)))
    assert voices.at("ann", 20 * SECOND - FRAME_NS) is None
    voices.receive("ann", message(SECOND, to_bytes(SHUT)))
    assert voices.at("ann", SECOND) is not None


@pytest.mark.parametrize("data", [b"", b"\x01" * 14, b"\x01" * 16, b"\x00" * 15, b"\xff" * 60_000])
def test_what_are_no_visemes_counts_as_none(data: bytes) -> None:
    assert from_bytes(data) is None
    voices = HeardVoices()
    voices.receive("ann", message(SECOND, data, level_db=float("nan")))
    heard = voices.at("ann", SECOND)
    assert heard is not None and heard.visemes is None and heard.level_db == -np.inf


def test_weights_come_through_a_message() -> None:
    weights = np.random.default_rng(3).dirichlet(np.ones(len(VISEMES)))
    found = from_bytes(to_bytes(weights))
    assert found is not None and np.abs(found - weights).max() < 0.01 and found.sum() == pytest.approx(1.0)
    assert from_bytes(to_bytes(np.full(len(VISEMES), np.nan))) is None

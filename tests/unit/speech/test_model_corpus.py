"""What the acoustic model is made from: voices that can be mixed, and speech whose times are known in every place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.hearing import sets
from scripts.speech_model.believe import fitted
from scripts.speech_model.corpus import seeded
from scripts.speech_model.english import held_out, reading, texts
from scripts.speech_model.frames import session, warped
from scripts.speech_model.japanese import HTS_MIXED, shares
from scripts.speech_model.rooms import Noises
from scripts.speech_model.texts import ENGLISH
from scripts.speech_model.training import OFFSETS, Frames
from scripts.speech_model.voice_file import ORDER, alike
from scripts.speech_model.voices import RATE, Spoken
from vistel.speech.acoustic import packaged, state_of
from vistel.speech.confidence import FEATURES
from vistel.speech.features import BANDS
from vistel.speech.grammar_file import load_grammar
from vistel.speech.phones import PHONES


def spoken() -> Spoken:
    """0.2 s of quiet, half a second of a buzz that is called "a", 0.2 s of quiet."""
    buzz = 0.1 * np.sign(np.sin(2 * np.pi * 150.0 * np.arange(RATE // 2) / RATE))
    quiet = np.zeros(RATE // 5)
    return Spoken(np.concatenate([quiet, buzz, quiet]).astype(np.float32), ("pau", "a", "pau"), np.array([0.2, 0.7, 0.9]))


def test_whatever_sounds_between_the_utterances_is_a_pause() -> None:
    noises = Noises(seeded(1, "noises"), [spoken().sound])
    for seed in range(6):
        made = session(seeded(seed, "session"), [spoken()] * 3, noises, packaged("japanese").start_mean, PHONES)
        said = int((made.states > 0).sum())
        assert set(made.states.tolist()) == {0, state_of(PHONES.index("a"), 0.0), state_of(PHONES.index("a"), 0.5)}
        assert 3 * 50 / 1.2 < said < 3 * 50 / 0.84
        assert np.isfinite(made.frames).all()


def test_no_window_of_frames_crosses_sessions() -> None:
    noises = Noises(seeded(1, "noises"), [spoken().sound])
    made = [session(seeded(k, "session"), [spoken()], noises, packaged("japanese").start_mean, PHONES) for k in range(2)]
    frames = Frames(made)
    assert frames.known[0] + OFFSETS[0] >= 0
    assert frames.known[-1] + OFFSETS[-1] < len(frames.values)
    first = len(made[0].frames)
    last_of_first, first_of_second = frames.known[first - 1], frames.known[first]
    assert last_of_first + OFFSETS[-1] < first_of_second
    assert first_of_second + OFFSETS[0] > last_of_first


def test_mixtures_name_two_or_three_voices_and_none_is_alone() -> None:
    for seed in range(40):
        found = shares(seeded(seed, "shares"))
        assert len(found) in (2, 3)
        assert set(found) <= set(HTS_MIXED)
        assert sum(found.values()) == pytest.approx(1.0)
        assert max(found.values()) <= 0.8


def a_voice(path: Path, length: int, name: str) -> np.ndarray:
    """A file with one spectral distribution for each of five states; the values it holds."""
    values = np.arange(5 * 2 * 3 * length, dtype=np.float32).reshape(5, 2, 3, length)
    parts = {
        "DURATION_PDF": b"dp",
        "DURATION_TREE": b"dt",
        f"STREAM_WIN[{name}]": b"w1w2w3",
        "STREAM_WIN[LF0]": b"w",
        "STREAM_WIN[LPF]": b"w",
        f"STREAM_PDF[{name}]": np.ones(5, np.uint32).tobytes() + values.tobytes(),
        "STREAM_PDF[LF0]": b"lf",
        "STREAM_PDF[LPF]": b"lp",
        f"STREAM_TREE[{name}]": b"tree",
        "STREAM_TREE[LF0]": b"tf",
        "STREAM_TREE[LPF]": b"tp",
        f"GV_PDF[{name}]": b"variance",
    }
    at, lines = 0, ""
    for key, part in parts.items():
        spans = [(at + k, at + k + 1) for k in (0, 2, 4)] if part == b"w1w2w3" else [(at, at + len(part) - 1)]
        lines += f"{key}:{','.join(f'{a}-{b}' for a, b in spans)}\n"
        at += len(part)
    head = f"[GLOBAL]\nNUM_STATES:5\n[STREAM]\nVECTOR_LENGTH[{name}]:{length}\nOPTION[{name}]:ALPHA=0.55\n[POSITION]\n"
    path.write_bytes((head + lines + "[DATA]\n").encode() + b"".join(parts.values()))
    return values


def test_a_finer_voice_is_cut_and_its_variance_left_out(tmp_path: Path) -> None:
    values = a_voice(tmp_path / "fine.htsvoice", 50, "MGC")
    alike(tmp_path / "fine.htsvoice", tmp_path / "alike.htsvoice")
    head, _, data = (tmp_path / "alike.htsvoice").read_bytes().partition(b"[DATA]\n")
    lines = dict(line.split(":", 1) for line in head.decode().split("\n") if ":" in line)
    begin, end = map(int, lines["STREAM_PDF[MCP]"].split("-"))
    kept = np.frombuffer(data[begin : end + 1], np.float32, offset=20).reshape(5, 2, 3, ORDER)
    np.testing.assert_array_equal(kept, values[..., :ORDER])
    windows = [tuple(map(int, span.split("-"))) for span in lines["STREAM_WIN[MCP]"].split(",")]
    assert [data[a : b + 1] for a, b in windows] == [b"w1", b"w2", b"w3"]
    assert b"variance" not in data


def test_a_voice_of_another_kind_is_refused_by_name(tmp_path: Path) -> None:
    a_voice(tmp_path / "coarse.htsvoice", 25, "MCP")
    with pytest.raises(ValueError, match=r"coarse\.htsvoice: expected 5 states and 35 or more"):
        alike(tmp_path / "coarse.htsvoice", tmp_path / "out.htsvoice")


def test_confidence_accepts_what_was_right_and_nothing_of_other_talk() -> None:
    random = np.random.default_rng(2)

    def rows(count: int, mean: float) -> np.ndarray:
        made = random.normal(mean, 0.5, (count, FEATURES))
        made[:, 0], made[:, 3], made[:, 4] = 1.0, 0.02, random.uniform(0.1, 1.0, count)
        return made

    right, wrong, talk, sounds = rows(200, -0.5), rows(20, -2.5), rows(60, -4.0), rows(20, -4.0)
    belief = fitted(right, wrong, talk, sounds, 7.0, margin=0.5, whole=0.3)
    assert ((right @ belief) > 0).mean() > 0.95
    assert not ((talk @ belief) > 0).any()


def test_english_is_trained_on_no_voice_and_no_command_of_the_other_sets() -> None:
    grammar, _ = load_grammar()
    others = (*sets.choose().voices["en"], *sets.report().voices["en"])
    assert not {voice.rpartition("+")[2] for voice in others} & set(ENGLISH["variants"].split())
    held = held_out(grammar)
    assert {*sets.choose().sentences, *sets.report().sentences} <= held
    said = [text for _, text in zip(range(400), texts(seeded(3), grammar), strict=False)]
    assert not held & set(said)
    assert all(len(reading(text)) > 2 for text in said)


def test_the_is_said_otherwise_before_a_vowel() -> None:
    assert reading("the box") == ("pau", "DH", "AH", "B", "AA", "K", "S", "pau")
    assert reading("the apple")[1:4] == ("DH", "IY", "AE")


def test_a_longer_throat_lowers_what_sounds() -> None:
    frames = np.zeros((3, BANDS), np.float32)
    frames[:, 22] = 1.0
    np.testing.assert_array_equal(warped(frames, 1.0), frames)
    assert warped(frames, 1.1).argmax(1).tolist() == [20] * 3
    assert warped(frames, 0.9).argmax(1).tolist() == [24] * 3

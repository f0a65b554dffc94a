"""Visemes from sound: lips that shut for what is said with shut lips, a mouth at rest in silence, no sound that breaks it."""

import numpy as np
import pytest

from vistel.arrays import F32, F64
from vistel.audio.heard_voices import Speech
from vistel.audio.opus import FRAME, FRAME_NS, RATE
from vistel.audio.resample import reach, sinc_resample
from vistel.audio.visemes import VISEMES
from vistel.figure.face.countenance import Countenance
from vistel.figure.face.marks import MARK_INDEX
from vistel.figure.posture.posture import Posture
from vistel.speech.synthesis import synthesise, voices
from vistel.speech.visemes.reader import VisemeReader


def read(sound: F32) -> F64:
    """(packets, 15) weights of a sound at 48 kHz."""
    reader = VisemeReader()
    return np.array([reader.feed(sound[k : k + FRAME]) for k in range(0, len(sound) - FRAME + 1, FRAME)])


def spoken(text: str, voice: str) -> F32:
    """The sound at 48 kHz, quiet before it."""
    if voice.partition(":")[0] not in {name.partition(":")[0] for name in voices()}:
        pytest.skip(f"{voice} is not installed")
    sound, rate = synthesise(text, voice)
    step = rate / RATE
    padded = np.concatenate([np.zeros(int(0.3 * rate) + reach(step), np.float32), sound, np.zeros(reach(step) + 1, np.float32)])
    return sinc_resample(padded, float(reach(step)), step, int((len(padded) - 2 * reach(step) - 1) / step))


def openings(weights: F64) -> list[float]:
    """How far apart the lips are at each packet [m]."""
    face, out = Countenance(), list[float]()
    for n, now in enumerate(weights):
        marks = face.step(Posture(), n * FRAME_NS, Speech(-20.0, now)).expression.marks
        out.append(0.0 if marks is None else float(marks[MARK_INDEX["upper_lip"], 1] - marks[MARK_INDEX["lower_lip"], 1]))
    return out


def times_opened(apart: list[float]) -> int:
    """How often lips that were shut came well apart."""
    times, shut = 0, True
    for each in apart:
        if shut and each > 0.006:
            times, shut = times + 1, False
        shut = shut or each < 0.0015
    return times


@pytest.mark.parametrize(("text", "voice"), [("mama, papa, mama", "flite:rms"), ("まま、ぱぱ、まま", "espeak-ng:ja")])
def test_lips_shut_for_each_p_and_m_and_open_for_each_a(text: str, voice: str) -> None:
    weights = read(spoken(text, voice))
    assert np.allclose(weights.sum(1), 1.0, atol=1e-4)
    assert weights[:10, 0].min() > 0.6  # quiet before it
    assert times_opened(openings(weights)) in (5, 6, 7)


def test_rounded_and_spread_vowels_are_told_apart() -> None:
    most = [read(spoken(text, "espeak-ng:ja")).max(0) for text in ("うううおおお", "いいいえええ")]
    (rounded, not_rounded), (not_spread, spread) = (
        [max(each[VISEMES.index(a)], each[VISEMES.index(b)]) for each in most] for a, b in (("ou", "oh"), ("ih", "E"))
    )
    assert min(rounded, spread) > 0.8
    assert max(not_rounded, not_spread) < 0.5


def test_no_sound_breaks_it() -> None:
    random = np.random.default_rng(4)
    broken = np.full(FRAME, np.nan, np.float32)
    for sound in (broken, broken * np.inf, np.ones(FRAME, np.float32) * 1e30, np.zeros(FRAME, np.float32)):
        weights = read(np.concatenate([sound, random.normal(0.0, 0.1, 20 * FRAME).astype(np.float32)]))
        assert np.isfinite(weights).all() and np.allclose(weights.sum(1), 1.0, atol=1e-4)

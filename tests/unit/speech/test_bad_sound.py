"""Commands from bad microphones are understood all the same, and nothing is made of what is no command: Japanese and English."""

from __future__ import annotations

import wave
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from vistel.audio.recording import read_recording
from vistel.speech.features import Resampler
from vistel.speech.grammar import Grammar, Language
from vistel.speech.recognisers import checked_grammar, recogniser
from vistel.speech.recognition import SAMPLE_RATE, Recogniser
from vistel.speech.synthesis import synthesise, voices

RECORDED = Path(__file__).parent / "recordings" / "red-box-right.wav"
BELIEVED = 0.5
Sound = np.ndarray


@pytest.fixture(scope="module")
def grammar() -> Grammar:
    return checked_grammar()[0]


def spoken(language: Language) -> tuple[Sound, str]:
    """A command, and its text."""
    if language == "ja":
        sound, rate = read_recording(RECORDED)
        return Resampler(rate).feed(sound), RECORDED.with_suffix(".txt").read_text().strip()
    pytest.importorskip("pocketsphinx")
    if "flite:rms" not in voices():
        pytest.skip("flite is not installed")
    text = "move the red box to the right"
    sound, rate = synthesise(text, "flite:rms")
    quiet = 1e-3 * np.random.default_rng(1).standard_normal(SAMPLE_RATE).astype(np.float32)
    return np.concatenate([quiet, 0.5 * Resampler(rate).feed(sound) / np.abs(sound).max(), quiet]), text


def clipped(sound: Sound) -> Sound:
    """Six times too loud for its microphone."""
    return np.clip(6.0 * sound, -0.5, 0.5)


def telephone(sound: Sound) -> Sound:
    """As 8000 samples a second hold it."""
    spectrum = np.fft.rfft(sound)
    spectrum[np.fft.rfftfreq(len(sound), 1.0 / SAMPLE_RATE) > 3800.0] = 0.0
    narrow = np.fft.irfft(spectrum, len(sound))[::2].astype(np.float32)
    return Resampler(8000.0).feed(narrow)


def shouted(sound: Sound) -> Sound:
    """Brighter, and into the limits."""
    bright = np.concatenate([sound[:1], sound[1:] - 0.6 * sound[:-1]])
    return np.clip(bright / np.abs(bright).max() * 2.0, -1.0, 1.0).astype(np.float32)


def heard(hears: Recogniser, sound: Sound) -> list[tuple[tuple[str, ...], float]]:
    found = [each for at in range(0, len(sound), 480) for each in hears.feed(sound[at : at + 480])]
    return [(each[0].words, each[0].confidence) for each in [*found, *hears.flush()]]


@pytest.mark.parametrize(
    ("language", "spoil"),
    [("ja", clipped), ("ja", telephone), ("ja", shouted), ("en", telephone)],
    ids=lambda each: each if isinstance(each, str) else each.__name__,
)
def test_a_command_from_a_bad_microphone_is_understood(
    language: Language, spoil: Callable[[Sound], Sound], grammar: Grammar
) -> None:
    """English that is clipped or shouted is not among these: pocketsphinx misses much of it."""
    sound, text = spoken(language)
    found = heard(recogniser(language, grammar), spoil(sound))
    meant = grammar.read(text)
    assert meant is not None
    assert [said.means for words, _ in found if (said := grammar.sentence(words, language))] == [meant.means]


def test_of_a_recording_whose_other_channel_is_dead_the_living_one_is_heard(tmp_path: Path, grammar: Grammar) -> None:
    sound, rate = read_recording(RECORDED)
    path = tmp_path / "dead.wav"
    with wave.open(str(path), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(2)
        file.setframerate(int(rate))
        file.writeframes(np.stack([np.rint(32767 * sound), np.zeros(len(sound))], 1).astype("<i2").tobytes())
    ((words, confidence),) = heard(recogniser("ja", grammar), Resampler(rate).feed(read_recording(path)[0]))
    said, meant = grammar.sentence(words, "ja"), grammar.read(RECORDED.with_suffix(".txt").read_text().strip())
    assert said is not None
    assert meant is not None
    assert said.means == meant.means
    assert confidence >= BELIEVED


def test_another_language_is_no_command(grammar: Grammar) -> None:
    """German and Japanese talk to English, German and English to Japanese: none is believed."""
    if "espeak-ng" not in voices():
        pytest.skip("espeak-ng is not installed")
    pytest.importorskip("pocketsphinx")
    talk = {
        "de": "wir treffen uns morgen nach der arbeit am bahnhof und gehen dann zusammen essen",
        "ja": "きのうは ともだちと えいがを みてから ばんごはんを たべました",
        "en-us": "my sister told me about the concert yesterday evening",
    }
    for language, others in (("en", ("de", "ja")), ("ja", ("de", "en-us"))):
        hears = recogniser(language, grammar)
        for other in others:
            sound, rate = synthesise(talk[other], f"espeak-ng:{other}")
            quiet = 1e-3 * np.random.default_rng(1).standard_normal(SAMPLE_RATE).astype(np.float32)
            found = heard(hears, np.concatenate([quiet, Resampler(rate).feed(sound), quiet]))
            assert [c for _, c in found if c >= BELIEVED] == [], (language, other)

"""English is heard, other talk is not believed, and steady noise is taken out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vistel.speech import enrolment
from vistel.speech.acoustic import Acoustic, Adaptation, packaged
from vistel.speech.alignment import align, chain_of
from vistel.speech.engines.choice import Chosen
from vistel.speech.engines.denoise import Denoiser
from vistel.speech.enrolment import Voice
from vistel.speech.features import BANDS, LogMel, Normaliser, Resampler, as_float
from vistel.speech.grammar_file import load_grammar
from vistel.speech.phones import PAUSE
from vistel.speech.recognisers import checked_grammar, recogniser, text_phones, unrecognisable
from vistel.speech.recognition import SAMPLE_RATE
from vistel.speech.synthesis import SynthesisError, synthesise, voices

VOICE = "flite:rms" if "flite:rms" in voices() else "espeak-ng:en-us"
both = pytest.mark.parametrize("chosen", [None, Chosen("pocketsphinx")], ids=["own", "pocketsphinx"])
needs_a_voice = pytest.mark.skipif(not voices(), reason="neither flite nor espeak-ng is installed")


def said(text: str) -> np.ndarray:
    pcm, rate = synthesise(text, VOICE)
    quiet = 1e-4 * np.random.default_rng(2).standard_normal(int(0.6 * rate)).astype(np.float32)
    return Resampler(rate).feed(np.concatenate([quiet, pcm * np.float32(0.1 / np.sqrt(np.mean(pcm**2))), quiet, quiet]))


@needs_a_voice
@both
def test_commands_are_understood_one_after_the_other_and_talk_is_believed_less(chosen: Chosen | None) -> None:
    grammar, faults = checked_grammar()
    assert faults == []
    hears = recogniser("en", grammar, chosen=chosen)
    sound = np.concatenate([said("move the blue box to the right"), said("make the cone larger")])
    found = [h for at in range(0, len(sound), 333) for h in hears.feed(sound[at : at + 333])]
    texts = [s.text if (s := grammar.sentence(h[0].words, "en")) else "" for h in found]
    assert texts == ["move the blue box to the right", "make the cone larger"]
    assert 0.3 < found[0][0].start_s < 0.9 < found[0][0].end_s < found[1][0].start_s
    talk = said("I think we should have lunch before the meeting starts")
    other = [*hears.feed(talk), *hears.flush()]
    assert max((h[0].confidence for h in other), default=0.0) < min(h[0].confidence for h in found)
    hears.reset()
    assert hears.flush() == []
    assert hears.feed(np.full(SAMPLE_RATE, np.nan, np.float32)) == []


HUMAN = """
[classes.rank]
all = { en = ["ace", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "jack", "queen", "king", "lady"] }
[classes.suit]
all = { en = ["clubs", "hearts", "diamonds", "spades"] }
[classes.direction]
all = { en = ["forward", "backward"] }
[classes.unit]
all = { en = ["meter", "meters"] }
[[sentences]]
en = ["<rank> of? <suit>", "<rank> <rank> of? <suit>", "<rank> <rank>", "go <direction> <rank> <unit>?"]
"""


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("goforward.raw", "go forward ten meters"),
        ("cards/001.wav", "ten of clubs"),
        ("cards/002.wav", "four queen of clubs"),
        ("cards/003.wav", "seven of clubs"),
    ],
)
@both
def test_people_are_understood(shared_data: Path, tmp_path: Path, name: str, text: str, chosen: Chosen | None) -> None:
    pytest.importorskip("pocketsphinx")
    path = shared_data / "speech" / name
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    (tmp_path / "human.toml").write_text(HUMAN)
    grammar, faults = load_grammar(tmp_path / "human.toml", base=None)
    assert faults == []
    pcm = np.frombuffer(path.read_bytes()[44 if name.endswith(".wav") else 0 :], "<i2")
    hears = recogniser("en", grammar, chosen=chosen)
    found = [*hears.feed(pcm), *hears.flush()]
    said = grammar.sentence(found[0][0].words, "en")
    assert said is not None
    assert said.text == text


def test_weak_that_is_no_way_to_say_that() -> None:
    pytest.importorskip("pocketsphinx")
    from vistel.speech.engines.sphinx import pronunciations

    lines = pronunciations(["the", "that", "zzyzx"]).splitlines()
    assert lines[0] == "that DH AE T"
    assert [line.split()[0] for line in lines[1:]] == ["the", "the(2)"]


@needs_a_voice
@both
@pytest.mark.parametrize("kind", ["clipped", "after an hour's silence"])
def test_bad_sound_stops_nothing(kind: str, chosen: Chosen | None) -> None:
    pytest.importorskip("pocketsphinx")
    grammar, _ = checked_grammar()
    hears = recogniser("en", grammar, chosen=chosen)
    sound = said("make the cone larger")
    if kind == "clipped":
        sound = np.clip(5.0 * sound, -1.0, 1.0).astype(np.float32)
    else:
        for _ in range(12):  # seconds stand for the hour: nothing is kept of silence
            assert hears.feed(np.zeros(5 * SAMPLE_RATE, np.float32)) == []
    found = [*hears.feed(sound), *hears.flush()]
    best = grammar.sentence(found[0][0].words, "en") if found and found[0][0].words else None
    assert best is not None
    assert best.text == "make the cone larger"


@needs_a_voice
def test_enrolment_undoes_a_change_of_voice(tmp_path: Path) -> None:
    pytest.importorskip("pocketsphinx")
    texts = (
        "make the cone larger",
        "move the blue box to the right",
        "turn the red ring a little to the left",
        "create a small cone over there",
        "delete the green table",
        "put the chair there",
    )
    of_a_child = [(_higher(said(text)), text_phones("en", text)) for text in texts]
    path = tmp_path / "voice.npz"
    enrolment.save(Voice("en", enrolment.adapt(packaged("english"), of_a_child[1:])), path)
    again = enrolment.load(path)
    assert again.language == "en"
    assert _fit(again.adaptation, *of_a_child[0]) > 0.9 * _fit(None, *of_a_child[0])


def _higher(sound: np.ndarray) -> np.ndarray:
    """As of a throat a quarter shorter."""
    return np.interp(np.arange(0.0, len(sound) - 1.0, 1.25), np.arange(len(sound)), sound).astype(np.float32)


def test_a_voice_that_was_learnt_in_another_language_is_not_used_and_that_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    pytest.importorskip("pocketsphinx")
    path = tmp_path / "aiko.npz"
    enrolment.save(Voice("ja", Adaptation(np.eye(BANDS, dtype=np.float32), np.zeros(BANDS, np.float32))), path)
    recogniser("en", checked_grammar()[0], path)
    assert "event=voice_of_another_language" in caplog.text
    assert "vistel speech enrol --language en" in caplog.text


def _fit(adaptation: Adaptation | None, sound: np.ndarray, phones: tuple[str, ...]) -> float:
    """How well the net finds what was read, as mean log probability of a frame."""
    model = packaged("english")
    frames = Normaliser(model.start_mean).feed(LogMel().feed(as_float(sound)))
    scores = Acoustic(model, adaptation).feed_all(frames)
    return align(scores, chain_of((PAUSE, *phones, PAUSE), model.phones)[0])[1]


def test_words_without_a_pronunciation_are_named() -> None:
    pytest.importorskip("pocketsphinx")
    assert "'zzyzx'" in (unrecognisable("en", "move zzyzx") or "")
    assert unrecognisable("en", "move") is None
    assert unrecognisable("ja", "はこ") is None
    assert unrecognisable("ja", "箱") is not None
    with pytest.raises(ValueError, match="'zzyzx' is not in the dictionary"):
        text_phones("en", "move zzyzx")


def test_noise_is_taken_out_and_speech_stays() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(3 * SAMPLE_RATE) / SAMPLE_RATE
    tone = np.where((t > 1.5) & (t < 2.0), 0.05 * np.sin(2 * np.pi * 700 * t), 0.0)
    noisy = (tone + 0.02 * rng.standard_normal(len(t))).astype(np.float32)
    denoiser = Denoiser()
    parts = [denoiser.feed(noisy[at : at + 777]) for at in range(0, len(noisy), 777)]
    clean = np.concatenate(parts)
    assert [len(p) for p in parts] == [len(noisy[at : at + 777]) for at in range(0, len(noisy), 777)]
    quiet = slice(SAMPLE_RATE, int(1.4 * SAMPLE_RATE))
    loud = slice(int(1.6 * SAMPLE_RATE), int(1.9 * SAMPLE_RATE))
    assert np.std(clean[quiet]) < 0.6 * np.std(noisy[quiet])
    assert np.std(clean[loud]) == pytest.approx(np.std(noisy[loud]), rel=0.25)


def test_what_cannot_be_said_is_reported() -> None:
    with pytest.raises(SynthesisError, match="not installed"):
        synthesise("hello", "nobody:here")
    if "espeak-ng" in voices():
        with pytest.raises(SynthesisError, match="kanji"):
            synthesise("箱", "espeak-ng:ja")

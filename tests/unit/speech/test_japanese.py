"""The Japanese recogniser hears recorded commands of a voice it was not trained on, and survives what is no speech."""

from __future__ import annotations

import hashlib
import wave
from pathlib import Path

import numpy as np
import pytest

from vistel.speech import acoustic, enrolment
from vistel.speech.acoustic import Adaptation, model_file, packaged
from vistel.speech.alignment import align, chain_of
from vistel.speech.automaton import compile_automaton
from vistel.speech.enrolment import Voice
from vistel.speech.features import BANDS, LogMel, Normaliser, as_float
from vistel.speech.grammar import Grammar
from vistel.speech.grammar_file import load_grammar
from vistel.speech.hybrid import ACCEPT, HybridRecogniser
from vistel.speech.phones import PHONES, kana_phones, kana_ways
from vistel.speech.recognisers import text_phones
from vistel.speech.recognition import Hypotheses

RECORDINGS = sorted((Path(__file__).parent / "recordings").glob("*.wav"))


@pytest.fixture(scope="module")
def grammar() -> Grammar:
    return load_grammar()[0]


@pytest.fixture
def recogniser(grammar: Grammar) -> HybridRecogniser:
    return HybridRecogniser(compile_automaton(grammar.patterns("ja", kana_ways), PHONES), packaged("japanese"))


def samples(path: Path) -> np.ndarray:
    with wave.open(str(path)) as file:
        assert file.getframerate() == 16000
        return np.frombuffer(file.readframes(file.getnframes()), np.int16)


def heard(recogniser: HybridRecogniser, sound: np.ndarray, chunk: int = 320) -> list[Hypotheses]:
    found = [each for at in range(0, len(sound), chunk) for each in recogniser.feed(sound[at : at + chunk])]
    return [*found, *recogniser.flush()]


@pytest.mark.parametrize("path", RECORDINGS, ids=[p.stem for p in RECORDINGS])
def test_a_recorded_command_is_understood_and_believed(path: Path, grammar: Grammar, recogniser: HybridRecogniser) -> None:
    expected = path.with_suffix(".txt").read_text().strip()
    (found,) = heard(recogniser, samples(path))
    said = grammar.sentence(found[0].words, "ja")
    meant = grammar.read(expected)
    assert said is not None
    assert meant is not None
    assert said.means == meant.means
    assert found[0].confidence >= ACCEPT
    assert 0.0 < found[0].start_s < found[0].end_s < len(samples(path)) / 16000
    assert len({each.words for each in found}) == len(found)


def test_how_the_stream_is_cut_does_not_change_what_is_heard(recogniser: HybridRecogniser, grammar: Grammar) -> None:
    sound = samples(RECORDINGS[0])
    again = HybridRecogniser(compile_automaton(grammar.patterns("ja", kana_ways), PHONES), packaged("japanese"))
    (a,), (b,) = heard(recogniser, sound, 320), heard(again, sound, 1777)
    assert a[0].words == b[0].words
    assert a[0].confidence == pytest.approx(b[0].confidence, abs=0.05)


def test_nobody_is_heard_in_silence_noise_clipping_and_numbers_that_are_none(recogniser: HybridRecogniser) -> None:
    random = np.random.default_rng(1)
    noise = (0.01 * random.standard_normal(16000 * 6)).astype(np.float32)
    square = np.sign(np.sin(2 * np.pi * 100.0 * np.arange(16000 * 3) / 16000)).astype(np.float32) * 5.0
    for sound in (np.zeros(16000 * 6, np.int16), noise, square, np.full(16000, np.nan, np.float32)):
        assert [each for each in heard(recogniser, sound, 16000) if each[0].confidence >= ACCEPT] == []


def test_talk_without_end_is_cut_and_forgotten(recogniser: HybridRecogniser) -> None:
    said = samples(RECORDINGS[0])
    pieces = said[: len(said) // 320 * 320].reshape(-1, 320).astype(float)
    loud = np.linalg.norm(pieces, axis=1)
    sound = np.tile(pieces[loud > 0.1 * loud.max()].reshape(-1), 30).astype(np.int16)  # 28 s without a breath
    pending = [0]
    for at in range(0, len(sound), 1600):
        recogniser.feed(sound[at : at + 1600])
        pending.append(recogniser.pending_frames)
    assert 500 < max(pending) <= 1000  # talk is kept,
    assert min(np.diff(pending)) < -500  # until it is cut


def test_a_model_of_another_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "model.npz"
    with np.load(model_file("japanese")) as data:
        np.savez(path, **{**dict(data), "version": np.array(99)})
    with pytest.raises(ValueError, match=r"is of version 99, .* make speech-model"):
        acoustic.load(path)
    path.write_bytes(b"no model")
    with pytest.raises(ValueError, match="cannot be read"):
        acoustic.load(path)


def test_the_models_in_the_package_are_small_and_say_how_they_were_made() -> None:
    for name, licence in (("japanese", "Creative Commons Attribution"), ("english", "Apache License")):
        assert model_file(name).stat().st_size < 2_000_000
        assert licence in model_file(name).with_suffix(".md").read_text()
    digest = hashlib.sha256(model_file("english").read_bytes()).hexdigest()
    assert digest in model_file("english").with_suffix(".md").read_text()


def test_enrolment_undoes_a_change_of_voice(grammar: Grammar, tmp_path: Path) -> None:
    """A turned spectrum fits the net better after it was learnt from than before, also in what was not read."""
    read = [(samples(p), p.with_suffix(".txt").read_text().strip()) for p in RECORDINGS]
    dull = [(_dull(sound), text) for sound, text in read]
    learnt = enrolment.adapt(packaged("japanese"), [(sound, text_phones("ja", text)) for sound, text in dull[1:]])
    path = tmp_path / "voice.npz"
    enrolment.save(Voice("ja", learnt), path)
    again = enrolment.load(path)
    assert again.language == "ja"
    np.testing.assert_array_equal(again.adaptation.turn, learnt.turn)
    assert path.stat().st_size < 20_000
    assert _fit(again.adaptation, *dull[0]) > _fit(None, *dull[0])


def test_enrolment_names_what_it_cannot_use(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is not kana"):
        text_phones("ja", "赤い")
    with pytest.raises(ValueError, match="no recording holds the text"):
        enrolment.adapt(packaged("japanese"), [(np.zeros(1600, np.int16), text_phones("ja", "あかいはこをうごかして"))])
    with pytest.raises(ValueError, match="vistel speech enrol"):
        enrolment.load(tmp_path / "none.npz")
    learnt = {"turn": np.eye(BANDS), "shift": np.zeros(BANDS)}
    np.savez(tmp_path / "first.npz", version=1, **learnt)
    assert enrolment.load(tmp_path / "first.npz").language == "ja"  # it had no other
    np.savez(tmp_path / "fr.npz", version=2, language="fr", **learnt)
    with pytest.raises(ValueError, match="is of the language 'fr', expected one of ja, en"):
        enrolment.load(tmp_path / "fr.npz")


def _dull(sound: np.ndarray) -> np.ndarray:
    out = sound.astype(np.float32) / 32768.0
    for _ in range(2):
        out = np.convolve(out, [0.5, 0.5])[: len(out)]
    return out.astype(np.float32)


def _fit(adaptation: Adaptation | None, sound: np.ndarray, text: str) -> float:

    frames = Normaliser(packaged("japanese").start_mean).feed(LogMel().feed(as_float(sound)))
    assert frames.shape[1] == BANDS
    scores = acoustic.Acoustic(packaged("japanese"), adaptation).feed_all(frames)
    return align(scores, chain_of(("pau", *kana_phones(text), "pau"), PHONES)[0])[1]

"""Other recognisers: what they are told, what is read from them, and what is said where they are missing.

With a model: VISTEL_MODEL_VOSK, _SHERPA, _WHISPER, _JULIUS name one each.
"""

from __future__ import annotations

import importlib.util
import json
import os
import random
import shutil
import wave
from pathlib import Path

import numpy as np
import pytest

from vistel.speech.engines import julius, sherpa, vosk, whisper
from vistel.speech.engines.choice import Chosen, EngineName
from vistel.speech.features import Resampler
from vistel.speech.grammar import Language
from vistel.speech.grammar_file import load_grammar
from vistel.speech.recognisers import RecogniserError, recogniser
from vistel.speech.recognition import SAMPLE_RATE, Recogniser
from vistel.speech.synthesis import synthesise, voices

GRAMMAR, _ = load_grammar()
RECORDINGS = Path(__file__).parent / "recordings"
PACKAGES = {"vosk": "vosk", "sherpa": "sherpa_onnx", "whisper": "pywhispercpp"}


def with_model(engine: str) -> Path:
    """Or the test is skipped, with the reason."""
    path = os.environ.get(f"VISTEL_MODEL_{engine.upper()}")
    if path is None:
        pytest.skip(f"no model of {engine}: VISTEL_MODEL_{engine.upper()} names none")
    return Path(path)


@pytest.mark.parametrize("engine", ["vosk", "sherpa", "whisper", "julius"])
def test_what_is_missing_is_reported_in_one_line(engine: EngineName, tmp_path: Path) -> None:
    pytest.importorskip("pocketsphinx")
    with pytest.raises(RecogniserError, match=f"{engine}: needs a model"):
        recogniser("ja", GRAMMAR, chosen=Chosen(engine))
    nowhere = tmp_path / "nothing"
    package_missing = engine in PACKAGES and importlib.util.find_spec(PACKAGES[engine]) is None
    program_missing = engine == "julius" and shutil.which("julius") is None
    with pytest.raises(RecogniserError, match="not installed" if program_missing else "nothing") as e:
        recogniser("ja", GRAMMAR, chosen=Chosen(engine, nowhere))
    assert "\n" not in str(e.value)
    if package_missing:
        model = tmp_path / "streaming-model"
        (model / "am").mkdir(parents=True)
        for name in ("am/final.mdl", "tokens.txt", "encoder.onnx", "decoder.onnx", "joiner.onnx"):
            (model / name).touch()
        (tmp_path / "ggml.bin").write_bytes(b"lmgg")
        with pytest.raises(RecogniserError, match=rf"{engine}: its package is not installed \(pip install \S+=="):
            recogniser("ja", GRAMMAR, chosen=Chosen(engine, tmp_path / "ggml.bin" if engine == "whisper" else model))


def test_a_file_that_is_no_model_is_reported(tmp_path: Path) -> None:
    (tmp_path / "some.bin").write_bytes(b"hello")
    with pytest.raises(RecogniserError, match=r"is no model of whisper\.cpp"):
        recogniser("en", GRAMMAR, chosen=Chosen("whisper", tmp_path / "some.bin"))
    with pytest.raises(RecogniserError, match=r"holds no am/final\.mdl"):
        recogniser("en", GRAMMAR, chosen=Chosen("vosk", tmp_path))
    with pytest.raises(RecogniserError, match=r"holds no tokens\.txt"):
        recogniser("ja", GRAMMAR, chosen=Chosen("sherpa", tmp_path))


def test_vosk_gets_phrases_it_knows_and_its_results_are_read() -> None:
    told = vosk.phrases(GRAMMAR, "en", lambda word: word != "cylinder")
    assert {"move", "to the right", "red"} <= set(told)
    assert "cylinder" not in told
    assert vosk.phrases(GRAMMAR, "ja", lambda word: True) == []
    some = {"alternatives": [{"text": "make it [unk] larger", "confidence": 210.0}, {"text": "", "confidence": 209.0}]}
    assert [(t.text.split(), t.confidence) for t in vosk.transcripts(json.dumps(some))] == [(["make", "it", "larger"], 1.0)]
    assert vosk.transcripts('{"text": ""}') == []


def test_sherpa_gets_the_phrases_its_tokens_can_spell(tmp_path: Path) -> None:
    (tmp_path / "tokens.txt").write_text("<blk> 0\nと 1\nめ 2\nて 3\n", "utf-8")
    assert sherpa.hotwords(GRAMMAR, "ja", tmp_path) == ("とめて",)
    assert sherpa.hotwords(GRAMMAR, "en", tmp_path) == ()
    (tmp_path / "bpe.vocab").touch()
    assert "TO THE RIGHT" in sherpa.hotwords(GRAMMAR, "en", tmp_path)


@pytest.mark.parametrize(("language", "end"), [("en", "."), ("ja", "")])
def test_whisper_gets_sentences(language: Language, end: str) -> None:
    text = whisper.prompt(GRAMMAR, language)
    assert text.endswith(end)
    first = text.split("。" if language == "ja" else ". ")[0]
    assert GRAMMAR.read(first) is not None


def test_julius_is_given_the_grammar_backwards() -> None:
    dfa, words = julius.automaton(GRAMMAR)
    entries = [line.split(" ", 2) for line in words.splitlines()]
    number = {text.strip("[]"): int(n) for n, text, _ in entries}
    arcs = {(int(a), int(c)): int(b) for a, c, b, *_ in (line.split() for line in dfa.splitlines())}
    for seed in range(20):
        said = GRAMMAR.pick("ja", random.Random(seed))
        units = [part for w in said.words for part in w.spoken.split()]
        state = 0
        for word in ["</s>", *reversed(units), "<s>"]:
            state = arcs[state, number[word]]
        assert (state, -1) in arcs
    assert {text: phones for _, text, phones in entries}["[おおきい]"] == "o: k i:"


def test_what_julius_prints_is_read() -> None:
    said = "pass1_best: x\nsentence1: <s> これ を けして </s>\ncmscore1: 1.000 0.900 0.500 0.700 1.000\n"
    said += "sentence2: <s> けして </s>\ncmscore2: 1 0.9 1\n"
    assert [(t.text, round(t.confidence, 3)) for t in julius.transcripts(said)] == [("これをけして", 0.7), ("けして", 0.7)]
    assert julius.transcripts("<input rejected by short input>\n") == []


def heard(hears: Recogniser, samples: np.ndarray, rate: float) -> tuple[str, float]:
    quiet = 1e-4 * np.random.default_rng(1).standard_normal(SAMPLE_RATE).astype(np.float32)
    sound = np.concatenate([quiet, Resampler(rate).feed(samples), quiet])
    found = [h for at in range(0, len(sound), 1600) for h in hears.feed(sound[at : at + 1600])] + hears.flush()
    words, confidence = max(((h[0].words, h[0].confidence) for h in found), key=lambda each: each[1], default=((), 0.0))
    said = next((s for language in GRAMMAR.languages if (s := GRAMMAR.sentence(words, language)) is not None), None)
    return said.spoken if said and words else "", confidence


def test_julius_hears_a_recording_and_is_started_anew_when_it_has_ended() -> None:
    hears = recogniser("ja", GRAMMAR, chosen=Chosen("julius", with_model("julius")))
    for name in ("red-box-right", "ball-here"):
        with wave.open(str(RECORDINGS / f"{name}.wav")) as file:
            samples = np.frombuffer(file.readframes(file.getnframes()), "<i2").astype(np.float32) / 32768.0
            text, confidence = heard(hears, samples, file.getframerate())
        wanted = GRAMMAR.read((RECORDINGS / f"{name}.txt").read_text("utf-8").strip())
        understood = GRAMMAR.read(text)
        assert wanted is not None
        assert understood is not None
        assert understood.means == wanted.means
        assert confidence > 0.5
        hears._engine._started.kill()  # type: ignore[attr-defined]
        assert heard(hears, samples, 16000.0) == ("", 0.0)


@pytest.mark.parametrize("engine", ["vosk", "sherpa", "whisper"])
def test_an_engine_hears_english(engine: EngineName) -> None:
    model = with_model(engine)
    if "flite:slt" not in voices():
        pytest.skip("flite is not installed")
    hears = recogniser("en", GRAMMAR, chosen=Chosen(engine, model))
    text, confidence = heard(hears, *synthesise("move the blue box to the right", "flite:slt"))
    assert text == "move the blue box to the right"
    assert confidence > 0.5

"""`vistel speech` from the command line."""

from __future__ import annotations

import json
import wave
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from vistel.speech.synthesis import synthesise, voices
from vistel_cli.main import app

RUN = CliRunner()
VOICE = next((v for v in ("flite:slt", "flite:rms") if v in voices()), "espeak-ng:en-us")
needs_a_voice = pytest.mark.skipif(not voices(), reason="neither flite nor espeak-ng is installed")


def recording(path: Path, text: str) -> None:
    pcm, rate = synthesise(text, VOICE)
    with wave.open(str(path), "wb") as w:
        w.setnchannels(1)
        w.setsampwidth(2)
        w.setframerate(int(rate))
        w.writeframes(np.rint(np.clip(pcm, -1, 1) * 32767).astype("<i2").tobytes())


def test_a_sentences_meaning_is_shown() -> None:
    done = RUN.invoke(app, ["speech", "grammar", "--read", "move the red box to the right"])
    assert done.exit_code == 0
    assert done.output.splitlines()[-1] == "MoveBy: which (shape box, colour red), towards right, distance 0.1"
    assert RUN.invoke(app, ["speech", "grammar", "--read", "good morning"]).exit_code == 1


def test_the_example_of_amounts_is_a_good_grammar_and_faults_are_named(tmp_path: Path) -> None:
    example = Path(__file__).parents[4] / "examples/speech/amounts.toml"
    assert RUN.invoke(app, ["speech", "grammar", str(example), "--examples", "3"]).exit_code == 0
    bad = tmp_path / "bad.toml"
    bad.write_text('[classes.c]\na = { kana = ["x"] }\n')
    done = RUN.invoke(app, ["speech", "grammar", str(bad)])
    assert done.exit_code == 1
    assert "bad.toml:2" in done.output.replace("\n", "")


@needs_a_voice
def test_recordings_are_scored_and_one_is_tried(tmp_path: Path) -> None:
    pytest.importorskip("pocketsphinx")
    recording(tmp_path / "move-the-blue-box-to-the-right.wav", "move the blue box to the right")
    recording(tmp_path / "a.wav", "make the cone larger")
    (tmp_path / "a.txt").write_text("make the cone larger")
    done = RUN.invoke(app, ["speech", "test", str(tmp_path), "--language", "en", "--json"])
    assert done.exit_code == 0
    assert json.loads(done.output.splitlines()[-1])["right"] == 2
    tried = RUN.invoke(app, ["speech", "try", str(tmp_path / "a.wav"), "--language", "en"])
    assert "make the cone larger" in tried.output


def test_what_is_wrong_is_reported_in_one_line(tmp_path: Path) -> None:
    assert RUN.invoke(app, ["speech", "test", str(tmp_path)]).exit_code == 1
    assert RUN.invoke(app, ["speech", "try", "--language", "fr"]).exit_code == 2
    missing = RUN.invoke(app, ["speech", "try", str(tmp_path / "none.wav"), "--language", "en"])
    assert missing.exit_code == 1

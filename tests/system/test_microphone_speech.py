"""Speech from a microphone, to the end: sentences are played into PulseAudio's null sink, whose monitor is the microphone.

Skipped where PulseAudio is not installed (`apt-get install pulseaudio libasound2-plugins`), those with sentences without
espeak-ng.
"""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import time
import wave
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from null_sink import environment_of, needs_pulseaudio, server

from vistel.speech import enrolment
from vistel.speech.synthesis import voices
from vistel_sim.sentences import synthesised_sentence

pytestmark = [pytest.mark.alone, pytest.mark.slow, needs_pulseaudio]
needs_voice = pytest.mark.skipif("espeak-ng" not in voices(), reason="espeak-ng is not installed")
VISTEL = (sys.executable, "-u", "-m", "vistel_cli.main")


class Program:
    """`vistel ...` that runs, and what it has printed so far."""

    def __init__(self, environment: dict[str, str], *arguments: str) -> None:
        self.text = ""
        self.process = subprocess.Popen(
            [*VISTEL, *arguments],
            env=environment | {"COLUMNS": "200"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        while letter := self.process.stdout.read(1):
            self.text += letter

    def until(self, pattern: str, since: int = 0) -> re.Match[str]:
        """Waits until it prints that, behind `since` letters; fails where it ends without."""
        while (found := re.search(pattern, self.text[since:])) is None:
            if "no sound card" in self.text:
                pytest.skip("PortAudio does not see PulseAudio: apt-get install libportaudio2 libasound2-plugins")
            assert self._reader.is_alive() or re.search(pattern, self.text[since:]), self.text
            time.sleep(0.05)  # another thread reads what the program prints
        return found

    def end(self) -> int:
        """Waits for it; its exit code."""
        self._reader.join()
        return self.process.wait()


@contextmanager
def running(environment: dict[str, str], *arguments: str) -> Iterator[Program]:
    program = Program(environment, *arguments)
    try:
        yield program
    finally:
        program.process.kill()
        program.process.wait()


@contextmanager
def pulseaudio(folder: Path, rate: int = 48_000) -> Iterator[tuple[dict[str, str], subprocess.Popen[bytes]]]:
    environment = environment_of(folder)
    process = server(folder, environment, rate)
    try:
        yield environment, process
    finally:
        process.kill()
        process.wait()


def play(text: str, folder: Path, environment: dict[str, str]) -> None:
    path = folder / "said.wav"
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(48_000)
        file.writeframes(np.rint(32_000 * np.clip(synthesised_sentence(text), -1.0, 1.0)).astype("<i2").tobytes())
    subprocess.run(["paplay", str(path)], env=environment, check=True, timeout=60)


@needs_voice
@pytest.mark.parametrize("rate", [8_000, 16_000, 96_000])
def test_a_sentence_into_a_microphone_is_understood_at_any_rate_of_its_card(tmp_path: Path, rate: int) -> None:
    with pulseaudio(tmp_path, rate) as (environment, _), running(environment, "speech", "try", "--seconds", "60") as listens:
        listens.until("listening")
        play("あおいはこをみぎにうごかして", tmp_path, environment)
        said = listens.until("([0-9.]+)–([0-9.]+) s .*\n")
        assert float(said[2]) - float(said[1]) > 1.5, "a piece of the sentence was lost"
        if rate >= 16_000:  # a telephone's band is not what the model was trained on
            assert re.search("青い箱.*右.*動かして", said[0]), listens.text
            assert "✓" in said[0]


def test_a_card_that_goes_while_it_is_listened_to_is_named(tmp_path: Path) -> None:
    with pulseaudio(tmp_path) as (environment, server), running(environment, "speech", "try", "--seconds", "60") as listens:
        listens.until("listening")
        server.kill()
        server.wait()
        listens.until("the microphone is gone")
        assert listens.end() == 1
        assert len([line for line in listens.text.splitlines() if "gone" in line]) == 1


@needs_voice
def test_a_voice_is_learnt_from_what_is_read_into_the_microphone(tmp_path: Path) -> None:
    learnt = tmp_path / "voices" / "aiko.npz"
    with pulseaudio(tmp_path) as (environment, _), running(environment, "speech", "enrol", str(learnt), "--sentences", "5") as asks:
        at = 0
        for n in range(1, 6):
            shown = asks.until(rf"{n}/5 +\S+ +(\S+)\s+Enter, then read", since=at)
            at += shown.end()
            assert asks.process.stdin is not None
            asks.process.stdin.write("\n")
            asks.process.stdin.flush()
            play(shown[1], tmp_path, environment)
        fits = asks.until(r"round 1 of 3, ([0-9]+) s of speech that fits")
        assert int(fits[1]) >= 18, "sentences were cut off"
        asks.until("learnt from 5 recordings")
        assert asks.end() == 0
        enrolment.load(learnt)

"""`vistel speech try` at a microphone: the monitor of PulseAudio's null sink.

Skipped where PulseAudio is not installed (`apt-get install pulseaudio libasound2-plugins`).
"""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from null_sink import environment_of, needs_pulseaudio, server

pytestmark = [pytest.mark.slow, needs_pulseaudio]
VISTEL = (sys.executable, "-u", "-m", "vistel_cli.main")


def program(environment: dict[str, str], *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*VISTEL, *arguments], env=environment | {"COLUMNS": "200"}, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


class Output:
    """What a program prints, read by a thread."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.text = ""
        self._process = process
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        while letter := self._process.stdout.read(1):
            self.text += letter

    def until(self, pattern: str, seconds: float = 120.0, since: int = 0) -> re.Match[str]:
        over = time.monotonic() + seconds
        while (found := re.search(pattern, self.text[since:])) is None:
            if "no sound card" in self.text:
                pytest.skip("PortAudio does not see PulseAudio: libasound2-plugins is missing")
            assert time.monotonic() < over, self.text
            assert self._process.poll() is None or re.search(pattern, self.text[since:]), self.text
            time.sleep(0.05)
        return found


def test_a_card_that_goes_while_it_is_listened_to_is_named(tmp_path: Path) -> None:
    environment = environment_of(tmp_path)
    pulse = server(tmp_path, environment)
    listens = program(environment, "speech", "try", "--seconds", "60")
    try:
        told = Output(listens)
        told.until("listening")
        time.sleep(2.0)
        pulse.kill()
        pulse.wait()
        assert listens.wait(30.0) == 1
        assert "the microphone is gone" in told.text
        assert len([line for line in told.text.splitlines() if "gone" in line]) == 1
    finally:
        listens.kill()
        listens.wait()

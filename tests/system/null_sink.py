"""A PulseAudio of one's own: what is played into its null sink is heard by the sink's monitor, a microphone to all programs."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from waiting import wait_until

needs_pulseaudio = pytest.mark.skipif(shutil.which("pulseaudio") is None, reason="PulseAudio is not installed")


def environment_of(folder: Path) -> dict[str, str]:
    """In which programs find the server of `folder` and no other."""
    return dict(os.environ) | {
        "PULSE_RUNTIME_PATH": str(folder),
        "XDG_RUNTIME_DIR": str(folder),
        "PULSE_COOKIE": str(folder / "cookie"),
        "PULSE_SERVER": f"unix:{folder}/native",
    }


def server(folder: Path, environment: dict[str, str], rate: int = 48_000) -> subprocess.Popen[bytes]:
    """Running, with a sink whose monitor is the microphone; rate: of both."""
    arguments = [
        "pulseaudio",
        "-n",
        "--exit-idle-time=-1",
        "--daemonize=no",
        "--disable-shm=yes",
        "-L",
        f"module-null-sink rate={rate}",
        "-L",
        f"module-native-protocol-unix socket={folder}/native auth-anonymous=1",
    ]
    (folder / "native").unlink(missing_ok=True)
    alone = {k: v for k, v in environment.items() if k != "PULSE_SERVER"}
    out = subprocess.Popen(arguments, env=alone, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_until(lambda: (folder / "native").exists() or out.poll() is not None)
    if out.poll() is not None:
        pytest.skip("PulseAudio does not start here")
    return out

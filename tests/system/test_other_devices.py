"""A whole conference with a LIBERTY or a tracking suite, 5DT gloves and a phone instead of a FASTRAK and CyberGloves."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from vistel.v1.motion_pb2 import Motion
from vistel.wire.log import LogReader
from vistel.wire.motion import MotionDecoder

pytestmark = pytest.mark.slow

FILE = """
name = "other"

[[sites]]
name = "here"

[sites.display]
video = false
width = 160
height = 90

[[sites.participants]]
name = "ann"

[sites.participants.tracker]
kind = "KIND"

[sites.participants.gloves.left]
kind = "5dt_ultra"

[sites.participants.gloves.right]
kind = "5dt_5"

[sites.participants.face]
port = "sim"
"""


@pytest.mark.parametrize("kind", ["liberty", "vmc"])
def test_a_conference_runs_with_them_and_everything_reaches_the_motion(tmp_path: Path, kind: str) -> None:
    file, out = tmp_path / "other.toml", tmp_path / "out"
    file.write_text(FILE.replace("KIND", kind))
    command = [sys.executable, "-m", "vistel_cli.main", "up", str(file), "--seconds", "8", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    devices = json.loads((out / "report.json").read_text())["devices"]
    assert set(devices) == {"ann-tracker", "ann-glove-left", "ann-glove-right", "ann-face"}
    assert all(d["frames"] > 100 for d in devices.values())
    (log,) = out.glob("*.mcap")
    messages: list[Motion] = [r.message for r in LogReader(log).records(topics=("motion",))]
    decoder = MotionDecoder()
    motions = [m for m in map(decoder.decode, messages) if m is not None][100:]
    assert motions and all(m.body.any() and m.face is not None and m.gaze is not None for m in motions)
    assert len({m.hands.tobytes() for m in motions}) > len(motions) // 4

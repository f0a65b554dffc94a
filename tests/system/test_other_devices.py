"""A whole conference with a LIBERTY and a tracking suite, 5DT gloves, gloves of a VRPN server and a phone instead of FASTRAKs and
CyberGloves."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from small_site import SMALL_SITE

from vistel.v1.motion_pb2 import Motion
from vistel.wire.log import LogReader
from vistel.wire.motion import MotionDecoder

pytestmark = [pytest.mark.alone, pytest.mark.slow]

FILE = f"""
name = "other"
{SMALL_SITE}
[sites.participants.tracker]
kind = "liberty"

[sites.participants.gloves.left]
kind = "5dt_ultra"

[sites.participants.gloves.right]
kind = "5dt_5"

[sites.participants.face]
port = "sim"

[[sites.participants]]
name = "ben"
height = 1.82
avatar = "builtin:person=ben"

[sites.participants.tracker]
kind = "vmc"

[sites.participants.gloves.left]
kind = "vrpn"

[sites.participants.gloves.right]
kind = "vrpn_pinch"

[sites.participants.face]
port = "sim"
"""


def test_a_conference_runs_with_them_and_everything_reaches_the_motion(tmp_path: Path) -> None:
    file, out = tmp_path / "other.toml", tmp_path / "out"
    file.write_text(FILE)
    command = [sys.executable, "-m", "vistel_cli.main", "up", str(file), "--seconds", "8", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    devices = json.loads((out / "report.json").read_text())["devices"]
    assert set(devices) == {f"{p}-{d}" for p in ("aiko", "ben") for d in ("tracker", "glove-left", "glove-right", "face")}
    # Contacts are told when they change, and twenty times a second on being asked; everything else is measured more often.
    assert all(d["frames"] > (5 if name == "ben-glove-right" else 20) for name, d in devices.items())
    (log,) = out.glob("*.mcap")
    for person in ("aiko", "ben"):
        messages: list[Motion] = [r.message for r in LogReader(log).records(topics=("motion",)) if r.names["participant"] == person]
        decoder = MotionDecoder()
        motions = [m for m in map(decoder.decode, messages) if m is not None][100:]
        whole = [m for m in motions if m.body.any() and m.face is not None and m.gaze is not None]
        assert len(whole) > len(motions) / 2  # a face that a busy machine measures late is left out of what goes on meanwhile
        assert len({m.hands.tobytes() for m in motions}) > len(motions) // 4

"""`vistel log info`: what one asks of a log comes first, and topics are wrapped at slashes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from vistel.v1.motion_pb2 import Motion
from vistel.v1.world_pb2 import WorldState
from vistel.wire.log import LogWriter
from vistel.wire.topics import BY_NAME
from vistel_cli.log.info import wrap_at_slashes
from vistel_cli.main import app

START_NS = 1_700_000_000_000_000_000
CONFERENCE = """
name = "duo"
[[sites]]
name = "lab"
[[sites.participants]]
name = "ada"
program = true
[[sites.participants]]
name = "ben"
program = true
"""


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Ten seconds of the world, two people; ben is silent from 2 s to 5 s and gone after 8 s."""
    path = tmp_path / "duo.mcap"
    with LogWriter(path, conference=CONFERENCE) as writer:
        for n in range(101):
            at_ns = START_NS + n * 100_000_000
            for person in ("ada", "ben"):
                if person == "ada" or not (20 < n < 50 or n > 80):
                    motion = Motion()
                    motion.header.version, motion.header.t_ns = 1, at_ns
                    writer.write(BY_NAME["motion"], f"vistel/duo/site/lab/participant/{person}/motion", motion, at_ns)
            state = WorldState()
            state.header.version, state.header.t_ns = 1, at_ns
            writer.write(BY_NAME["world_state"], "vistel/duo/world/state", state, at_ns)
    return path


def shown(log: Path, *arguments: str) -> str:
    result = CliRunner().invoke(app, ["log", "info", str(log), *arguments], env={"COLUMNS": "80"})
    assert result.exit_code == 0, result.output
    return result.output


def test_length_and_people_and_what_is_missing_come_before_the_channels(log: Path) -> None:
    lines = shown(log).splitlines()
    assert lines[0].startswith("duo: 10.0 s from 2023-11-14 22:13:20 UTC")
    assert lines[1].split() == ["lab", "ada", "(10", "postures/s),", "ben", "(6", "postures/s)"]
    assert lines[2].split(maxsplit=1) == ["missing", "motion of ben: none for 3.0 s from 2.0 s"]
    assert lines[3].strip() == "motion of ben: ends at 8.0 s"
    assert lines[4].split() == ["damaged", "nothing"]
    assert "channels under vistel/duo/" in lines[6]


@pytest.mark.parametrize(("goes_on_s", "missing"), [(5, 0), (15, 1)])
def test_a_recorder_that_stops_after_the_sites_misses_nothing_of_them(log: Path, goes_on_s: int, missing: int) -> None:
    path = log.parent / "longer.mcap"
    with LogWriter(path, conference=CONFERENCE.replace('[[sites.participants]]\nname = "ben"\nprogram = true\n', "")) as writer:
        for n in range(10 * (2 + goes_on_s)):
            at_ns = START_NS + n * 100_000_000
            motion, state = Motion(), WorldState()
            motion.header.version = state.header.version = 1
            motion.header.t_ns = state.header.t_ns = at_ns
            if n < 20:
                writer.write(BY_NAME["motion"], "vistel/duo/site/lab/participant/ada/motion", motion, at_ns)
            writer.write(BY_NAME["world_state"], "vistel/duo/world/state", state, at_ns)
    assert json.loads(shown(path, "--json"))["missing"] == ["motion of ada: ends at 1.9 s"] * missing


def test_what_is_damaged_is_reported_once(log: Path) -> None:
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 4])
    said = shown(log)
    assert said.count("damaged") == 1
    assert "nothing" not in said.split("damaged")[1].splitlines()[0]


def test_json_has_the_same(log: Path) -> None:
    said = json.loads(shown(log, "--json"))
    assert (said["conference"], said["seconds"], said["sites"]) == ("duo", 10.0, {"lab": ["ada", "ben"]})
    assert len(said["missing"]) == 2
    assert [c["topic"] for c in said["channels"]] == ["motion", "motion", "world_state"]


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_no_line_is_wider_than_the_terminal(log: Path, columns: int) -> None:
    command = [sys.executable, "-m", "vistel_cli.main", "log", "info", str(log)]
    ran = subprocess.run(command, env=os.environ | {"COLUMNS": str(columns)}, capture_output=True, text=True, check=True)
    assert max(len(line) for line in ran.stdout.splitlines()) <= columns


def test_a_key_is_broken_after_slashes_only() -> None:
    key = "site/columbus/device/ben-glove-left/status"
    assert wrap_at_slashes(key, 42) == key
    assert wrap_at_slashes(key, 25) == "site/columbus/device/\n  ben-glove-left/status"
    assert wrap_at_slashes(key, 10).split() == ["site/", "columbus/", "device/", "ben-glove-left/", "status"]

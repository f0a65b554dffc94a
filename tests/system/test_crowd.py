"""`vistel sim crowd`: a real router and world, many who send, and what it says of them."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from vistel_services.world.service import warm_up

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

VISTEL = (sys.executable, "-m", "vistel_cli.main")
PEOPLE = 14


def test_a_crowd_is_measured_or_its_figures_are_said_to_be_void() -> None:
    warm_up()  # the command waits two minutes for a world, no longer
    command = [*VISTEL, "sim", "crowd", "-n", str(PEOPLE), "--receive", "4", "--seconds", "2", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0 or (done.returncode == 1 and "crowd: the figures say nothing" in done.stderr), done.stderr
    told = json.loads(done.stdout)
    assert told["people"] == PEOPLE
    assert told["motion_p50_ms"] <= told["motion_p99_ms"]
    assert 0 <= told["received_in_full"] <= PEOPLE
    if done.returncode == 0:  # a machine with so much else to do that the figures are void may have stood still meanwhile
        assert told["world_steps_per_s"] > 0 and told["received_messages_per_s"] > 0 and told["received_mbit_per_s"] > 0
        assert told["received_in_full"] > 0


def test_a_crowd_of_one_is_refused_in_one_line() -> None:
    done = subprocess.run([*VISTEL, "sim", "crowd", "-n", "1"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "Traceback" not in done.stderr

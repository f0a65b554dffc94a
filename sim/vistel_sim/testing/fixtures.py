"""The pytest plugin (entry point `pytest11`): simulated devices at real ports, for one test each."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from vistel_sim.testing.person import Gloves
    from vistel_sim.testing.units import PhoneUnit, Pose, SerialUnit, VrpnUnit


@pytest.fixture
def simulated_fastrak(tmp_path: Path) -> "Iterator[SerialUnit[dict[int, Pose]]]":
    """A Polhemus FASTRAK with four receivers on somebody who moves; `.path` is its serial port."""
    from vistel_sim.testing.person import Person

    with ExitStack() as ends:
        unit = Person(tmp_path).fastrak()
        ends.callback(unit.end)
        unit.wait_until_plugged()
        yield unit


@pytest.fixture
def simulated_gloves(tmp_path: Path) -> "Iterator[Gloves]":
    """Two CyberGloves: `.left.path` and `.right.path` are their serial ports."""
    from vistel_sim.testing.person import Person

    with ExitStack() as ends:
        gloves = Person(tmp_path).gloves()
        for unit in (gloves.left, gloves.right):
            ends.callback(unit.end)
        for unit in (gloves.left, gloves.right):
            unit.wait_until_plugged()
        yield gloves


@pytest.fixture
def simulated_vrpn(tmp_path: Path) -> "Iterator[VrpnUnit[dict[int, Pose]]]":
    """A VRPN server with a tracker; `.address` is DEVICE@127.0.0.1:PORT."""
    from vistel.conference.devices import TrackerConfig
    from vistel_sim.testing.person import Person

    with ExitStack() as ends:
        unit = Person(tmp_path, tracker=TrackerConfig(kind="vrpn")).vrpn()
        ends.callback(unit.end)
        unit.wait_until_plugged()
        yield unit


@pytest.fixture
def simulated_phone(tmp_path: Path) -> "Iterator[PhoneUnit[dict[str, float]]]":
    """A phone with Live Link Face that sends UDP packets to `.address`."""
    from vistel.conference.devices import FaceConfig
    from vistel_sim.testing.person import Person

    with ExitStack() as ends:
        unit = Person(tmp_path, face=FaceConfig(port="sim")).phone()
        ends.callback(unit.end)
        yield unit

"""A kind of device from another package is installed, found, checked, simulated, run and recorded like the built-in ones."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from device_site import STATE, RecordingBus, Running, run
from virtual_time import LoopClock

from vistel.conference.device_list import devices_of
from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.devices.kind import load as resolve
from vistel.devices.registry import kind_of, kinds, packaged_kinds
from vistel.devices.transport.serial_port import open_serial
from vistel.v1.device_pb2 import RawBytes
from vistel.wire.raw_bytes import reads_of
from vistel_services import tracker
from vistel_services.devices.device import Link
from vistel_services.devices.probe import who_answers
from vistel_services.devices.service import connect
from vistel_sim.device import SimulatedDevice
from vistel_sim.faults import Fault
from vistel_sim.process import simulators

T = "ann-tracker"
PACKAGE = Path(__file__).parents[3] / "examples" / "12_write_a_device_driver"
FILE = """
name = "beacons"
[[sites]]
name = "lab"
[[sites.participants]]
name = "ann"
gloves = {}
tracker = { kind = "beacon", stations = { chest = 1, head = 2, left_hand = 3, right_hand = 8 } }
"""


class Raised:
    """A motion whose receivers are held still, each at a height of its own."""

    def receivers(self, participant: str, t_s: float) -> dict[str, Any]:
        roles = ("chest", "head", "left_hand", "right_hand")
        return {role: (np.array([0.5, 0.0, -0.1 * (n + 1)]), np.array([0.0, 0.0, 0.0, 1.0])) for n, role in enumerate(roles)}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package in it."""
    folder = tmp_path_factory.mktemp("package")
    source = shutil.copytree(PACKAGE, folder / "source")  # what pip builds is left beside what it builds from
    pip = (sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--no-index")
    subprocess.run((*pip, "--target", str(folder / "installed"), str(source)), check=True)
    return folder / "installed"


@pytest.fixture
def beacon(installed: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """A conference file, with the package on the path."""
    monkeypatch.syspath_prepend(installed)
    packaged_kinds.cache_clear()
    file = tmp_path / "beacons.toml"
    file.write_text(FILE, "utf-8")
    yield file
    packaged_kinds.cache_clear()
    for name in [n for n in sys.modules if n.split(".")[0] == "beacon"]:
        del sys.modules[name]


def test_a_kind_of_another_package_runs_against_its_simulator(beacon: Path, tmp_path: Path) -> None:
    conference = load(beacon)
    fault = Fault(T, "garbage", 2.0, 0.5)

    async def scenario() -> None:
        clock, bus, paths = LoopClock(), RecordingBus(), RunPaths(tmp_path, tmp_path)
        motion, start_ns = Raised(), clock.now_ns()
        (device,) = simulators(conference, motion, paths, clock, start_ns, faults=(fault,))
        running = Running([device.run(), tracker.run(tracker.configure(conference, conference.sites[0], paths), bus, clock)])
        await running.until(lambda: clock.now_ns() - start_ns > 4_000_000_000)
        await running.close()
        status, frames = bus.status(T), bus.on("tracker", T)
        assert (status.state, status.detail) == (STATE.STATE_STREAMING, "Beacon, 4 receivers")
        assert status.rate_hz == pytest.approx(4 * 30, rel=0.05)
        assert status.bytes_skipped > 0
        assert {r.station for f in frames for r in f.receivers} == {1, 2, 3, 8}
        for frame in frames:
            for r in frame.receivers:
                assert r.position.z == pytest.approx(-0.1 * r.station if r.station < 8 else -0.4, abs=1e-4)
        # A replay reads the recorded bytes with the same driver.
        decoder = connect(devices_of(conference)[0]).driver.decoder
        raw = [m for m in bus.on("device_raw", T) if m.direction == RawBytes.DIRECTION_FROM_DEVICE]
        assert [f for m in raw for t_ns, data in reads_of(m) for f in decoder.feed(data, t_ns)] == frames

    run(scenario())


def test_a_port_is_asked_for_such_a_device_too(beacon: Path, tmp_path: Path) -> None:
    async def scenario() -> None:
        clock, port = LoopClock(), tmp_path / "port"
        unit = importlib.import_module("beacon.simulator").Beacon(Raised().receivers, (1,))
        running, link = Running([SimulatedDevice("unit", unit, port, clock, clock.now_ns()).run()]), Link(clock)
        await running.until(port.exists)
        transport = open_serial(str(port), 115200, clock)(lambda data, t_ns: link.arrived(data, 0), link.lose)
        link.attach(transport)
        assert await who_answers(link) == kind_of("tracker", "beacon")
        transport.close()
        await running.close()

    run(scenario())


def test_the_keys_of_such_a_device_are_checked(beacon: Path) -> None:
    beacon.write_text(FILE.replace("right_hand = 8", "right_hand = 9"), "utf-8")
    with pytest.raises(ConferenceError, match=r"toml:8: .*\.stations: a beacon has stations 1\.\.8; got 1, 2, 3, 9"):
        load(beacon)


def test_the_doctor_names_kinds_of_other_packages(installed: Path) -> None:
    path = os.pathsep.join(p for p in (str(installed), os.environ.get("PYTHONPATH", "")) if p)
    command = (sys.executable, "-m", "vistel_cli.main", "doctor", "--json")
    done = subprocess.run(command, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=False)
    found = {f["what"]: f["detail"] for f in json.loads(done.stdout)}
    assert found["More devices"] == "tracker 'beacon': an Example Beacon"


def test_without_its_package_a_kind_is_unknown(tmp_path: Path) -> None:
    file = tmp_path / "beacons.toml"
    file.write_text(FILE, "utf-8")
    with pytest.raises(ConferenceError, match=r"tracker\.kind: expected 'fastrak', .* or 'vrpn', got 'beacon'"):
        load(file)


@pytest.mark.parametrize("kind", kinds(), ids=lambda k: f"{k.role}-{k.name}")
def test_the_code_of_every_kind_is_where_it_says(kind: Any) -> None:
    for reference in filter(None, (kind.describe, kind.driver, kind.simulator, kind.fit, kind.doctor)):
        assert callable(resolve(reference))


def test_a_conference_is_written_and_read_with_the_kinds_of_its_devices() -> None:
    tracker = {"kind": "5dt_16", "port": "/dev/ttyUSB0"}
    person = {"name": "ann", "gloves": {"left": tracker}, "eye": {"source": "2"}}
    conference = Conference.model_validate({"sites": [{"name": "lab", "participants": [person]}]})
    glove = conference.sites[0].participants[0].gloves["left"]
    assert (glove.baud, glove.sensors) == (19200, 14)
    assert Conference.model_validate(conference.model_dump(mode="json", exclude_none=True)) == conference

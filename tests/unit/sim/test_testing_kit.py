"""The pytest plugin of the test kit, as somebody who installed `vistel[testing]` meets it."""

from __future__ import annotations

import os
import re
import socket
import threading
from pathlib import Path

import numpy as np
import pytest
import serial

from vistel.protocol import fastrak, live_link_face, vrpn
from vistel_sim.testing import person  # noqa: F401 what pytester imports must be there before: NumPy cannot be loaded twice
from vistel_sim.testing.device_thread import DeviceThread
from vistel_sim.testing.person import Gloves
from vistel_sim.testing.units import PhoneUnit, Pose, SerialUnit, VrpnUnit
from vistel_sim.testing.waiting import wait_until

ROOT = Path(__file__).resolve().parents[3]
EXAMPLE = ROOT / "examples/test_an_integration/test_my_tracker.py"
PAGE = ROOT / "docs/how-to/test-your-integration.md"
EXPECTED = ', pytest.raises(serial.SerialException, match="person-tracker")'
"""Without it the example's second test is the failing one that the page begins with."""


def left_behind() -> list[str]:
    """Threads of devices, and open masters of pseudo-terminals."""
    files = [os.readlink(f"/proc/self/fd/{n}") for n in os.listdir("/proc/self/fd") if os.path.lexists(f"/proc/self/fd/{n}")]
    return [t.name for t in threading.enumerate() if t.name.startswith("vistel ")] + [f for f in files if "ptmx" in f]


def test_the_file_of_the_page_passes_and_leaves_nothing_behind(pytester: pytest.Pytester) -> None:
    assert f"```python\n{EXAMPLE.read_text()}```" in PAGE.read_text("utf-8")
    pytester.makepyfile(test_my_tracker=EXAMPLE.read_text())
    before = left_behind()
    pytester.runpytest_inprocess("-p", "no:cacheprovider").assert_outcomes(passed=2)
    assert left_behind() == before


def test_a_program_that_does_not_expect_an_unplugged_tracker_fails_and_the_report_names_the_port(pytester: pytest.Pytester) -> None:
    assert EXAMPLE.read_text().count(EXPECTED) == 1
    pytester.makepyfile(test_my_tracker=EXAMPLE.read_text().replace(EXPECTED, ""))
    before = left_behind()
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["E *SerialException*could not open port*person-tracker*No such file*"])
    assert left_behind() == before


def test_the_fixtures_are_listed_with_what_they_are(pytester: pytest.Pytester) -> None:
    listed = pytester.runpytest_inprocess("--fixtures").stdout.str()
    for name in ("simulated_fastrak", "simulated_gloves", "simulated_vrpn", "simulated_phone"):
        assert re.search(rf"^{name} -- .*\n    \w+", listed, re.MULTILINE), name
        assert f"`{name}`" in PAGE.read_text("utf-8")


def test_a_tracker_that_is_pulled_out_hangs_up_and_comes_back(simulated_fastrak: SerialUnit[dict[int, Pose]]) -> None:
    with serial.Serial(str(simulated_fastrak.path), timeout=30.0) as line:
        line.write(b"C")
        assert line.read(47)
        with simulated_fastrak.unplugged():
            assert not os.path.lexists(simulated_fastrak.path)
            with pytest.raises(serial.SerialException):
                line.read(100_000)
    with serial.Serial(str(simulated_fastrak.path), timeout=30.0) as line:
        line.write(b"S")
        assert line.read_until(b"CPG2030").endswith(b"CPG2030")  # its identification


def test_faults_begin_and_end_with_their_block(simulated_fastrak: SerialUnit[dict[int, Pose]]) -> None:
    parser = fastrak.FastrakParser()
    with serial.Serial(str(simulated_fastrak.path), timeout=30.0) as line:
        line.write(b"".join(fastrak.output_list(n) for n in (1, 2, 3, 4)) + b"ufC")

        def read_until_skipped() -> bool:
            parser.feed(line.read(33), 0)
            return parser.bytes_skipped > 0

        with simulated_fastrak.garbled():
            wait_until(read_until_skipped, "garbage", within_s=60.0)
        with simulated_fastrak.saturated():
            wait_until(lambda: any(r.error == "j" for r in parser.feed(line.read(33), 0)), "saturation", within_s=60.0)
        with simulated_fastrak.stalled():
            line.timeout = 0.3
            wait_until(lambda: line.read(33) == b"", "silence", within_s=60.0)
        line.timeout = 30.0
        clean = fastrak.FastrakParser()
        assert any(clean.feed(line.read(33), 0) for _ in range(20))


def test_gloves_answer_at_their_ports(simulated_gloves: Gloves) -> None:
    for unit in (simulated_gloves.left, simulated_gloves.right):
        assert unit.truth(unit.now_s()).shape == (20,)
        with serial.Serial(str(unit.path), 115200, timeout=30.0) as line:
            line.write(b"G")
            assert line.read(1) == b"G" and len(line.read(19)) == 19


def test_a_vrpn_client_gets_the_true_poses(simulated_vrpn: VrpnUnit[dict[int, Pose]]) -> None:
    device, host, port = vrpn.parse_address(simulated_vrpn.address)
    parser, poses = vrpn.VrpnParser(), {}
    with socket.create_connection((host, port), timeout=30.0) as link:
        link.sendall(vrpn.hello(device))
        while len(poses) < 4:
            data = link.recv(4096)
            assert data
            poses |= {r.sensor + 1: r.position for r in parser.feed(data, 0) if isinstance(r, vrpn.PoseReport)}
    truth = simulated_vrpn.truth(simulated_vrpn.now_s())
    for station, position in poses.items():
        assert np.linalg.norm(np.array(position) - truth[station][0]) < 0.3
    with simulated_vrpn.unplugged(), pytest.raises(ConnectionRefusedError):
        socket.create_connection((host, port), timeout=30.0)
    assert simulated_vrpn.address.startswith("Tracker0@127.0.0.1:")


def test_a_phone_sends_what_its_face_does_to_its_address(simulated_phone: PhoneUnit[dict[str, float]]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(simulated_phone.address)
        ear.settimeout(30.0)
        packet = live_link_face.parse(ear.recv(4096))
        assert packet is not None
        now_s = simulated_phone.now_s()
        truths = [list(simulated_phone.truth(t).values()) for t in np.arange(max(0.0, now_s - 5.0), now_s, 0.0005)]
        assert np.abs(np.array(truths) - np.array(packet.values)).max(axis=1).min() < 0.02
        with simulated_phone.unplugged():
            ear.settimeout(0.3)

            def silent() -> bool:
                try:
                    return not ear.recv(4096)
                except TimeoutError:
                    return True

            wait_until(silent, "silence", within_s=60.0)
        ear.settimeout(30.0)
        assert ear.recv(4096)


def test_what_never_comes_is_named() -> None:
    with pytest.raises(AssertionError, match=r"^waited 0 s in vain for a second glove$"):
        wait_until(lambda: False, "a second glove", within_s=0.0)


def test_a_device_that_fails_is_said_with_its_cause() -> None:
    async def fails() -> None:
        raise OSError("no more terminals")

    thread = DeviceThread("tracker", fails())
    with pytest.raises(RuntimeError, match="simulated device tracker ended by itself") as error:
        wait_until(thread.check, "the failure", within_s=60.0)
    assert "no more terminals" in str(error.value.__cause__)
    with pytest.raises(RuntimeError, match="simulated device tracker ended by itself"):
        thread.end()
    assert "vistel tracker" not in left_behind()

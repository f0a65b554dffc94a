"""The pytest plugin of the test kit, as somebody who installed `vistel[testing]` meets it."""

from __future__ import annotations

import os
import re
import socket
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest
import serial

import vistel.log
from vistel.arrays import U8
from vistel.protocol import fastrak, live_link_face, polhemus, vrpn
from vistel.testing import conformance
from vistel.testing.conformance import Line, Target
from vistel.testing.conformance.ports import TcpLine
from vistel_sim.motion.source import MotionError
from vistel_sim.network.link import Conditions
from vistel_sim.testing import (
    conforming,
    person,  # noqa: F401 what pytester imports must be there before: NumPy cannot be loaded twice
)
from vistel_sim.testing.device_thread import DeviceThread
from vistel_sim.testing.fixtures import PlayLog, StartTracker
from vistel_sim.testing.network import Network
from vistel_sim.testing.person import Gloves
from vistel_sim.testing.room_units import DelayUnit, Helmet, MicrophoneUnit
from vistel_sim.testing.units import PhoneUnit, Pose, SerialUnit, VrpnUnit
from vistel_sim.testing.waiting import wait_until

ROOT = Path(__file__).resolve().parents[3]
EXAMPLE = ROOT / "examples/test_an_integration/test_my_tracker.py"
PAGE = ROOT / "docs/how-to/test-your-integration.md"
REFERENCE = ROOT / "docs/reference/test-kit.md"
FIXTURES = (
    *("simulated_fastrak", "simulated_tracker", "simulated_gloves", "simulated_vrpn", "simulated_phone"),
    *("simulated_helmet", "simulated_microphone", "simulated_delay_unit", "recording", "network", "conference"),
    "simulated_conference",
)
LOG = ROOT / "tests/replay/meeting.mcap"
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
    for name in FIXTURES:
        assert re.search(rf"^{name} -- .*\n    \w+", listed, re.MULTILINE), name
        assert f"`{name}`" in REFERENCE.read_text("utf-8")


def test_a_tracker_that_is_pulled_out_hangs_up_and_comes_back(simulated_fastrak: SerialUnit[dict[int, Pose]]) -> None:
    with serial.Serial(str(simulated_fastrak.path), timeout=300.0) as line:
        line.write(b"C")
        assert line.read(47)
        with simulated_fastrak.unplugged():
            assert not os.path.lexists(simulated_fastrak.path)
            with pytest.raises(serial.SerialException):
                line.read(100_000)
    with serial.Serial(str(simulated_fastrak.path), timeout=300.0) as line:
        line.write(b"S")
        assert line.read_until(b"CPG2030").endswith(b"CPG2030")  # its identification


def test_faults_begin_and_end_with_their_block(simulated_fastrak: SerialUnit[dict[int, Pose]]) -> None:
    parser = fastrak.FastrakParser()
    with serial.Serial(str(simulated_fastrak.path), timeout=300.0) as line:
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


def test_fixtures_of_one_test_do_not_meet(
    simulated_fastrak: SerialUnit[dict[int, Pose]],
    simulated_vrpn: VrpnUnit[dict[int, Pose]],
    simulated_tracker: StartTracker,
    recording: PlayLog,
) -> None:
    units = [
        simulated_fastrak,
        simulated_tracker("liberty"),
        simulated_tracker("fastrak"),
        recording(LOG).fastrak(),
        recording(LOG).fastrak(),
    ]
    assert len({unit.path.resolve() for unit in units}) == len(units)
    assert all(unit.path.is_symlink() and unit.plugged for unit in units) and simulated_vrpn.plugged


def test_gloves_answer_at_their_ports(simulated_gloves: Gloves) -> None:
    for unit in (simulated_gloves.left, simulated_gloves.right):
        assert unit.truth(unit.now_s()).shape == (20,)
        with serial.Serial(str(unit.path), 115200, timeout=300.0) as line:
            line.write(b"G")
            assert line.read(1) == b"G" and len(line.read(19)) == 19


def test_a_vrpn_client_gets_the_true_poses(simulated_vrpn: VrpnUnit[dict[int, Pose]]) -> None:
    device, host, port = vrpn.parse_address(simulated_vrpn.address)
    parser, poses = vrpn.VrpnParser(), {}
    with socket.create_connection((host, port), timeout=300.0) as link:
        link.sendall(vrpn.hello(device))
        while len(poses) < 4:
            data = link.recv(4096)
            assert data
            poses |= {r.sensor + 1: r.position for r in parser.feed(data, 0) if isinstance(r, vrpn.PoseReport)}
        now_s = simulated_vrpn.now_s()
        truths = [simulated_vrpn.truth(t) for t in np.arange(0.0, now_s + 0.05, 0.05)]  # a busy machine reads late
        for station, position in poses.items():
            assert min(np.linalg.norm(np.array(position) - truth[station][0]) for truth in truths) < 0.1
        with simulated_vrpn.unplugged():  # its port is free then: whoever answers there is another program
            with pytest.raises(FileNotFoundError):
                _ = simulated_vrpn.address
            while link.recv(4096):
                pass
    assert simulated_vrpn.address.startswith("Tracker0@127.0.0.1:")


def test_a_phone_sends_what_its_face_does_to_its_address(simulated_phone: PhoneUnit[dict[str, float]]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(simulated_phone.address)
        ear.settimeout(30.0)
        packet = live_link_face.parse(ear.recv(4096))
        assert packet is not None
        now_s = simulated_phone.now_s()
        truths = [list(simulated_phone.truth(t).values()) for t in np.arange(max(0.0, now_s - 30.0), now_s, 0.0005)]
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


def picture(address: str) -> U8:
    """The next picture of a camera, (h, w, 3)."""
    host, port = address.removeprefix("http://").partition("/")[0].split(":")
    with socket.create_connection((host, int(port)), timeout=300.0) as link:
        link.sendall(b"GET /video.mjpg HTTP/1.1\r\n\r\n")
        came = b""
        while (found := re.search(rb"Content-Length: (\d+)\r\n\r\n", came)) is None or len(came) < found.end() + int(found[1]):
            data = link.recv(65536)
            assert data, "the camera closed"
            came += data
    jpeg = came[found.end() : found.end() + int(found[1])]
    shown = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert shown is not None
    return np.asarray(shown, np.uint8)


def test_the_cameras_of_a_helmet_send_pictures_and_tell_what_is_in_them(simulated_helmet: Helmet) -> None:
    now_s = simulated_helmet.face.now_s()
    assert simulated_helmet.face.truth(now_s).shape == (13, 2) and simulated_helmet.eye.truth(now_s).shape == (2,)
    for camera in (simulated_helmet.face, simulated_helmet.eye):
        assert picture(camera.address).std() > 5.0
        with camera.dark():
            wait_until(lambda camera=camera: not picture(camera.address).any(), "a black picture", within_s=60.0)
        with camera.unplugged(), pytest.raises(FileNotFoundError):
            _ = camera.address
        assert picture(camera.address).any()


def test_a_microphone_gives_the_sound_that_it_says(simulated_microphone: MicrophoneUnit) -> None:
    with simulated_microphone.path.open("rb") as pipe:
        heard = [np.frombuffer(pipe.read(1920), "<i2") / 32767.0 for _ in range(20)]
        last = int(simulated_microphone.now_s() / 0.02) + 1
        spoken = np.array([simulated_microphone.truth((k + 0.5) * 0.02) for k in range(last)])
        for block in heard:
            assert np.abs(spoken - block).max(axis=1).min() < 1e-4
        with simulated_microphone.muted():
            wait_until(lambda: not np.frombuffer(pipe.read(1920), "<i2").any(), "silence", within_s=60.0)
    with pytest.raises(ValueError, match="no records that could be cut"):
        simulated_microphone.cut()
    with simulated_microphone.unplugged():
        assert not simulated_microphone.path.exists()


def test_a_delay_unit_conforms_delays_what_is_heard_and_forgets_when_it_is_switched_off(simulated_delay_unit: DelayUnit) -> None:
    def line() -> Line:
        host, port = simulated_delay_unit.address.split(":")
        return TcpLine(host, int(port))

    target = Target(line, unplugged=simulated_delay_unit.unplugged, patience=15.0)
    assert [(o.name, o.line) for o in conformance.run("delay_unit", target) if o.verdict != "pass"] == []
    check = {c.name: c for c in conformance.checks("delay_unit")}
    check["a_delay_is_reached_and_writes_are_counted"](target)
    assert simulated_delay_unit.truth(simulated_delay_unit.now_s())[0] == pytest.approx(0.02 + 0.0013)
    click = np.zeros(4800, np.float32)
    click[100] = 1.0
    assert int(np.argmax(simulated_delay_unit.heard(1, click))) - 100 == round(0.0213 * 48_000)


def test_a_delay_unit_on_a_serial_line_conforms(tmp_path: Path) -> None:
    with conforming.delay_unit(38400) as target:
        outcomes = list(conformance.run("delay_unit", Target(target.device, 38400, patience=15.0)))
    assert [(o.name, o.line) for o in outcomes if o.verdict == "fail"] == []
    assert sum(o.verdict == "pass" for o in outcomes) > 8


def test_a_log_is_played_into_a_tracker_and_gloves(recording: PlayLog) -> None:
    aiko = recording(LOG, "aiko")
    tracker, gloves = aiko.fastrak(), aiko.gloves()
    moved = list(vistel.log.open(LOG).postures("aiko"))
    for t, posture in (moved[0], moved[len(moved) // 2], moved[-1]):
        assert np.allclose(aiko.posture(t).dofs, posture.dofs, atol=1e-9)
        assert np.allclose(gloves.left.truth(t), posture.hands[0])
    wait_until(lambda: tracker.now_s() > moved[-1][0], "the end of the log", within_s=300.0)  # she keeps still from then on
    settings = b"".join(fastrak.output_list(n) + polhemus.hemisphere(n, (0.0, 0.0, -1.0)) for n in (1, 2, 3, 4))
    with serial.Serial(str(tracker.path), timeout=300.0) as line:
        line.write(settings + b"ufC")
        parser, poses = fastrak.FastrakParser(), {}
        while len(poses) < 4:
            poses |= {r.station: r.position for r in parser.feed(line.read(33), 0)}
    truth = tracker.truth(tracker.now_s())
    assert all(np.linalg.norm(np.array(poses[n]) - truth[n][0]) < 0.02 for n in (1, 2, 3, 4))


@pytest.mark.parametrize(
    ("log", "participant", "expected"),
    [(LOG, "zoe", "zoe"), (EXAMPLE, None, "is not an MCAP log"), (ROOT / "no.mcap", None, "no.mcap")],
)
def test_what_cannot_be_played_is_named_in_one_line(log: Path, participant: str | None, expected: str, recording: PlayLog) -> None:
    with pytest.raises(MotionError, match=expected) as error:
        recording(log, participant)
    assert "\n" not in str(error.value)


def test_a_link_passes_on_delays_and_can_be_cut(network: Network, simulated_vrpn: VrpnUnit[dict[int, Pose]]) -> None:
    port = int(simulated_vrpn.address.rpartition(":")[2])
    link = network.tcp(port, Conditions(delay_s=0.02, jitter_s=0.01, loss=0.02))
    with socket.create_connection(("127.0.0.1", link.port), timeout=300.0) as client:
        client.sendall(vrpn.hello("Tracker0"))
        assert client.recv(24)
        with link.cut():
            client.settimeout(0.3)

            def silent() -> bool:
                try:
                    return not client.recv(65536)
                except TimeoutError:
                    return True

            wait_until(silent, "what was on its way to arrive", within_s=60.0)
        client.settimeout(60.0)
        assert client.recv(24)
        link.change(Conditions())
        link.reset()
        with pytest.raises(ConnectionError):
            while client.recv(65536):
                pass
            raise ConnectionError  # or closed in an orderly way


def test_datagrams_pass_a_link_and_some_are_lost(network: Network) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as far, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as near:
        far.bind(("127.0.0.1", 0))
        far.settimeout(30.0)
        whole, lossy = network.udp(far.getsockname()[1]), network.udp(far.getsockname()[1], Conditions(loss=0.5))
        near.sendto(b"whole", ("127.0.0.1", whole.port))
        assert far.recv(100) == b"whole"
        sent, got = 200, 0
        for _ in range(sent):
            near.sendto(b"some", ("127.0.0.1", lossy.port))
        far.settimeout(0.1)

        def last_came() -> bool:
            nonlocal got
            near.sendto(b"last", ("127.0.0.1", lossy.port))  # it may be lost, and overtakes nothing
            try:
                came = far.recv(100)
            except TimeoutError:
                return False
            got += came == b"some"
            return came == b"last"

        wait_until(last_came, "the last one", within_s=60.0)
        assert 0 < got < sent
        with pytest.raises(ValueError, match="no connections"):
            whole.reset()


FAILING = """
import serial


def test_fails(simulated_fastrak):
    with serial.Serial(str(simulated_fastrak.path), timeout=300.0) as line, simulated_fastrak.drifting():
        line.write(b"S")
        assert line.read(55) == b"something else"
"""


@pytest.mark.parametrize("copied", [False, True])
def test_what_crossed_a_port_is_kept_and_named_when_a_test_fails(pytester: pytest.Pytester, copied: bool) -> None:
    pytester.makepyfile(test_mine=FAILING)
    options = ("--vistel-keep", str(pytester.path / "kept")) if copied else ()
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider", *options)
    result.assert_outcomes(failed=1)
    (named,) = [line for line in result.outlines if line.endswith("person-tracker.log")]
    if copied:
        assert Path(named) == pytester.path / "kept" / "test_mine.py__test_fails" / "person-tracker.log"
    text = Path(named).read_text()
    assert "drift begins" in text and "< 53  S" in text and "> 32 31 53" in text


def test_a_test_that_passes_names_nothing(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(FAILING.replace('== b"something else"', ""))
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider")
    result.assert_outcomes(passed=1)
    result.stdout.no_fnmatch_line("*VISTEL kept*")


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

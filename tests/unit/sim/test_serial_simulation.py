"""Simulated ports and mishaps."""

from __future__ import annotations

import asyncio
import os
import termios
from pathlib import Path

import numpy as np
import pytest
from waiting import until

from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.protocol.fastrak import FastrakParser
from vistel.wire import background
from vistel.wire.clock import SimulatedClock
from vistel_sim.device import SimulatedDevice, run_devices
from vistel_sim.fastrak import Fastrak
from vistel_sim.faults import DeviceFaults, Fault, fault_from_text
from vistel_sim.ports.pty_port import PtyPort
from vistel_sim.process import simulators

POSE = ((0.5, 0.1, -0.6), (0.0, 0.0, 0.0, 1.0))


def read_waiting(fd: int) -> bytes:
    try:
        return os.read(fd, 65536)
    except BlockingIOError:
        return b""


def test_the_line_takes_ten_bits_per_byte_and_one_message_at_a_time(tmp_path: Path) -> None:
    port = PtyPort(tmp_path / "p", SimulatedClock(), lambda data: None, baud=1000)
    assert port.reserve(10, 5_000) == 100_005_000
    assert port.reserve(10, 6_000) == 200_005_000
    assert port.reserve(1, 10**9) == 10**9 + 10_000_000


def test_unplugging_hangs_up_and_plugging_in_makes_a_new_port(tmp_path: Path) -> None:
    async def scenario() -> None:
        heard: list[bytes] = []
        port = PtyPort(tmp_path / "dev" / "p", SimulatedClock(), heard.append)
        port.plug()
        fd = os.open(port.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        assert not termios.tcgetattr(fd)[3] & (termios.ECHO | termios.ICANON)
        os.write(fd, b"\x03\r\x11")
        await until(lambda: b"".join(heard) == b"\x03\r\x11")
        port.unplug()
        assert not port.path.exists() and not port.path.is_symlink()

        def hung_up() -> bool:
            try:
                return os.read(fd, 1) == b""
            except BlockingIOError:
                return False
            except OSError:
                return True

        await until(hung_up)
        os.close(fd)
        port.plug()
        again = os.open(port.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        port.put(b"back")
        await until(lambda: read_waiting(again) == b"back")
        os.close(again)
        port.unplug()

    asyncio.run(scenario())


class WakesTheSecondFirst(SimulatedClock):
    """As on a busy machine: of two sleepers the one that is due first is woken last."""

    def __init__(self) -> None:
        super().__init__()
        self._sleepers_so_far, self._second_woken = 0, asyncio.Event()

    async def sleep_until_ns(self, t_ns: int) -> None:
        self._sleepers_so_far += 1
        if self._sleepers_so_far == 1:
            await self._second_woken.wait()
        else:
            self._second_woken.set()


def test_answers_keep_their_order_whichever_is_woken_first(tmp_path: Path) -> None:
    async def scenario() -> None:
        port = PtyPort(tmp_path / "p", WakesTheSecondFirst(), lambda data: None)
        async with background.service("test"):
            port.plug()
            fd = os.open(port.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            port.answer(b"first ")
            port.answer(b"second")
            came = bytearray()

            def all_there() -> bool:
                came.extend(read_waiting(fd))
                return len(came) >= 12

            await until(all_there)
            assert came == b"first second"
            os.close(fd)
            port.unplug()

    asyncio.run(scenario())


def test_a_port_that_nobody_reads_loses_whole_records(tmp_path: Path) -> None:
    async def scenario() -> None:
        port = PtyPort(tmp_path / "p", SimulatedClock(), lambda data: None)
        port.plug()
        sent = 0
        while port.dropped < 20 and sent < 5000:  # how much a kernel holds for who does not read differs
            port.put(b"0123456789" * 3 + b"\r\n!")
            sent += 1
            await asyncio.sleep(0.0)
        assert port.dropped == 20
        fd = os.open(port.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        got = bytearray()

        def all_read() -> bool:
            got.extend(read_waiting(fd))
            return len(got) >= 33 * (sent - port.dropped)

        await until(all_read)
        assert bytes(got) == (b"0123456789" * 3 + b"\r\n!") * (sent - port.dropped)
        os.close(fd)
        port.unplug()

    asyncio.run(scenario())


def test_what_the_kernel_does_not_take_at_once_comes_when_it_is_read(tmp_path: Path) -> None:
    async def scenario() -> None:
        port = PtyPort(tmp_path / "p", SimulatedClock(), lambda data: None)
        port.plug()
        fd = os.open(port.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        sent = bytes(range(250)) * 2000  # more than any kernel holds for a port
        port.put(sent)
        got = bytearray()

        def all_read() -> bool:
            got.extend(read_waiting(fd))
            return len(got) >= len(sent)

        await until(all_read)
        assert got == sent
        os.close(fd)
        port.unplug()

    asyncio.run(scenario())


class _Counted(Fastrak):
    sent = 0

    def measure(self, t_s: float) -> bytes:
        data = super().measure(t_s)
        self.sent += len(data)
        return data


def test_a_second_holds_120_records_stamped_where_they_were_measured(tmp_path: Path) -> None:
    async def scenario() -> None:
        clock = SimulatedClock(10**9)
        fastrak = _Counted(lambda station, t_s: ((t_s, 0.1, 0.0), POSE[1]), position_noise=0.0, angle_noise=0.0)
        device = SimulatedDevice("d", fastrak, tmp_path / "d", clock, clock.now_ns())
        task = asyncio.create_task(device.run())
        await until((tmp_path / "d").exists)
        fd = os.open(tmp_path / "d", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        fastrak.receive(b"".join(b"O%d,2,11,1\r" % n for n in (1, 2, 3, 4)) + b"ufC", 0.0)
        parser, records = FastrakParser(), []
        read = 0

        def all_read() -> bool:
            nonlocal read
            data = read_waiting(fd)
            read += len(data)
            records.extend(parser.feed(data, clock.now_ns()))
            return read == fastrak.sent

        for ms in range(1, 1001):
            await clock.advance_to_ns(10**9 + ms * 1_000_000)
            await until(all_read)  # the clock stands still while the kernel hands them over
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        os.close(fd)
        assert 118 <= len(records) <= 120
        assert [r.station for r in records[:5]] == [1, 2, 3, 4, 1]
        late = np.array([(r.t_ns - 10**9) * 1e-9 - r.position[0] for r in records])
        assert np.median(np.abs(late)) < 0.002
        assert not (tmp_path / "d").exists()

    asyncio.run(scenario())


def test_links_left_by_a_killed_process_are_gone_before_any_port_appears(tmp_path: Path) -> None:
    async def scenario() -> None:
        clock = SimulatedClock()
        names = ("a", "b")
        for name in names:
            (tmp_path / name).symlink_to("/nowhere")
        devices = [SimulatedDevice(n, Fastrak(lambda station, t_s: POSE), tmp_path / n, clock, 0) for n in names]
        task = asyncio.create_task(run_devices(devices))
        await until(lambda: all((tmp_path / n).exists() for n in names))
        assert (tmp_path / "a").resolve() != (tmp_path / "b").resolve()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(scenario())


def test_faults_act_in_their_time_on_their_device() -> None:
    faults = DeviceFaults([Fault("a", "stall", 1.0, 2.0), Fault("b", "stall", 0.0, 9.0)], "a", np.random.default_rng(0))
    assert [faults.active("stall", t) for t in (0.9, 1.1, 3.0, 3.1)] == [False, True, True, False]
    assert not faults.active("garbage", 2.0)


def test_garbage_goes_before_a_record_and_a_cut_takes_from_it() -> None:
    rng = np.random.default_rng(0)
    record = bytes(range(33))
    assert DeviceFaults([Fault("a", "garbage", 0.0, 9.0)], "a", rng).damage(record, 1.0).endswith(record)
    cut = DeviceFaults([Fault("a", "cut", 0.0, 9.0)], "a", rng).damage(record, 1.0)
    assert 0 < len(cut) < 33 and (record.startswith(cut) or record.endswith(cut))
    assert DeviceFaults([Fault("a", "cut", 0.0, 9.0)], "a", rng).damage(record, 10.0) == record


def test_faults_as_text() -> None:
    assert fault_from_text("ann-tracker:stall:5:0.5") == Fault("ann-tracker", "stall", 5.0, 0.5)
    for bad in ("x", "a:nap:1:2", "a:stall:soon:2"):
        with pytest.raises(ValueError, match="DEVICE:KIND:AT_S:FOR_S"):
            fault_from_text(bad)


class _Still:
    def receivers(self, participant: str, t_s: float):
        return {role: (np.array(POSE[0]), np.array(POSE[1])) for role in ("chest", "head", "left_hand", "right_hand")}

    def hand_angles(self, participant: str, t_s: float):
        return np.zeros((2, 20))


def test_a_conference_has_its_simulated_devices_and_no_others(tmp_path: Path) -> None:
    person = {"name": "ann", "tracker": {"port": "/dev/ttyUSB0"}}
    conference = Conference(
        sites=[Site(name="a", participants=[Participant(**person)]), Site(name="b", participants=[Participant(name="bob")])]
    )
    paths = RunPaths(tmp_path, tmp_path)

    def names(site: str | None = None, faults: tuple[Fault, ...] = ()) -> list[str]:
        clock = SimulatedClock()
        return [d.name for d in simulators(conference, _Still(), paths, clock, 0, site=site, faults=faults)]

    assert names() == ["ann-glove-left", "ann-glove-right", "bob-tracker", "bob-glove-left", "bob-glove-right"]
    assert names("a") == ["ann-glove-left", "ann-glove-right"]
    with pytest.raises(ValueError, match="no simulated device 'ann-tracker'"):
        names(faults=(Fault("ann-tracker", "stall", 1.0, 1.0),))

"""The delay service against simulated equipment over Modbus, TCP and serial: what is asked, what is heard, what goes wrong."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Coroutine, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import until

from vistel.protocol.equipment import DELAY_UNIT, Register
from vistel.v1.audio_pb2 import EquipmentRequest, EquipmentStatus
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.delay import Config, Device, run
from vistel_services.delay.client import ModbusDevice
from vistel_services.delay.service import run_device
from vistel_sim.equipment.delay_unit import OWN_LATENCY, RATE, DelayLine, SimulatedDelayUnit
from vistel_sim.equipment.room_device import SimulatedRoomDevice
from vistel_sim.faults import Fault, Kind

S = EquipmentStatus
LINES = pytest.mark.parametrize("baud", [0, 38400], ids=["tcp", "rtu"])


class Room:
    """A unit, the service that keeps it, and what it says."""

    def __init__(
        self,
        folder: Path,
        bus: MemoryBus,
        clock: SystemClock,
        device: Device | None = None,
        baud: int = 0,
        registers: Mapping[str, Register] | None = None,
    ) -> None:
        """baud: of a serial line, 0 for TCP. registers: of a device that is no delay unit."""
        self.clock, self.bus, self.start_ns = clock, bus, clock.now_ns()
        at = ("unit", folder / "unit", clock, self.start_ns)
        self.unit: Any = (
            SimulatedDelayUnit(*at, baud=baud) if registers is None else SimulatedRoomDevice(*at, registers=registers, baud=baud)
        )
        self.device = device or Device("delay", "sim", folder / "unit", 1, DELAY_UNIT, delay_channel=1)
        self._status = bus.subscribe(BY_NAME["equipment_status"])
        self.status = S()

    def ask(self, **settings: float) -> None:
        request = EquipmentRequest(equipment="delay")
        for name, value in settings.items():
            request.settings.add(name=name, value=value)
        self.bus.publish(BY_NAME["equipment_request"], equipment="delay").put(request)

    def set_fault(self, kind: Kind) -> None:
        self.unit.set_faults(Fault("unit", kind, (self.clock.now_ns() - self.start_ns) * 1e-9 - 0.001, 60.0))

    async def until(self, wanted: Callable[[EquipmentStatus], bool]) -> EquipmentStatus:
        def told() -> bool:
            for sample in self._status.take():
                self.status = sample.message
                if wanted(self.status):
                    return True
            return False

        await until(told)
        return self.status


def with_room(
    tmp_path: Path,
    play: Callable[[Room], Coroutine[Any, Any, None]],
    device: Device | None = None,
    baud: int = 0,
    registers: Mapping[str, Register] | None = None,
) -> None:
    async def main() -> None:
        clock = SystemClock()
        room = Room(tmp_path, MemoryNetwork().bus("c", "tokyo", clock), clock, device, baud, registers)
        tasks = [asyncio.create_task(t) for t in (room.unit.run(), run(Config((room.device,)), room.bus, clock))]
        try:
            await play(room)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(main())


def holds(delay_s: float) -> Callable[[EquipmentStatus], bool]:
    wanted = delay_s + 1e-4 * OWN_LATENCY
    return lambda s: s.delay_known and s.state == S.STATE_OBSERVED and abs(s.acoustic_s - wanted) < 2e-4


@LINES
def test_a_unit_goes_to_what_is_asked_says_what_it_does_and_is_heard_to_do_it(tmp_path: Path, baud: int) -> None:
    async def play(room: Room) -> None:
        await room.until(holds(0.0))
        room.ask(delay=0.02)
        await room.until(holds(0.02))
        click = np.zeros(4800, np.float32)
        click[100] = 1.0
        heard = room.unit.process(0, click)
        assert int(np.argmax(heard)) - 100 == pytest.approx((0.02 + 1e-4 * OWN_LATENCY) * RATE, abs=1)

    with_room(tmp_path, play, baud=baud)


@LINES
@pytest.mark.parametrize("kind", ["stall", "cut"])
def test_without_good_answers_for_a_second_the_delay_is_unknown_until_they_return(tmp_path: Path, kind: Kind, baud: int) -> None:
    async def play(room: Room) -> None:
        room.ask(delay=0.01)
        await room.until(holds(0.01))
        room.set_fault(kind)
        why = "busy" if kind == "cut" else "no answer"  # a machine that stands still for a second is no answer at first
        lost = await room.until(lambda s: s.state == S.STATE_UNKNOWN and why in s.detail)
        assert not lost.delay_known
        room.unit.set_faults()
        back = await room.until(holds(0.01))
        assert back.reconnects >= 1

    with_room(tmp_path, play, baud=baud)


@LINES
def test_a_unit_that_comes_back_at_its_defaults_is_given_its_settings_again(tmp_path: Path, baud: int) -> None:
    async def play(room: Room) -> None:
        room.ask(delay=0.015)
        await room.until(holds(0.015))
        room.set_fault("unplug")
        await room.until(lambda s: s.state == S.STATE_UNKNOWN)
        room.unit.set_faults()
        await room.until(holds(0.015))

    with_room(tmp_path, play, baud=baud)


@LINES
def test_exceptions_are_a_fault_with_their_meaning_and_end_when_the_unit_does_well(tmp_path: Path, baud: int) -> None:
    async def play(room: Room) -> None:
        await room.until(holds(0.0))
        room.set_fault("garbage")
        fault = await room.until(lambda s: s.state == S.STATE_FAULT)
        assert "exception 4" in fault.detail
        assert not fault.delay_known
        assert fault.refusals >= 1
        room.unit.set_faults()
        await room.until(holds(0.0))

    with_room(tmp_path, play, baud=baud)


def test_requests_that_make_no_sense_are_reported_and_left_out(tmp_path: Path) -> None:
    async def play(room: Room) -> None:
        room.ask(delay=3.0, actual_1=0.1, nonsense=1.0)
        told = await room.until(lambda s: bool(s.detail) and s.state == S.STATE_OBSERVED)
        assert "nonsense" in told.detail
        room.ask(delay=0.01)
        await room.until(lambda s: s.delay_known and s.acoustic_s > 0.01)

    with_room(tmp_path, play)


def test_it_ends_also_where_a_cancellation_comes_together_with_an_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reads = 0
    read_all = ModbusDevice.read_all

    async def read_and_lose(device: ModbusDevice) -> dict[str, float]:
        """As asyncio.wait_for of Python 3.11 loses one."""
        nonlocal reads
        reads += 1
        found = await read_all(device)
        task = asyncio.current_task()
        assert task is not None
        if reads == 3:
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await asyncio.sleep(0)
        return found

    monkeypatch.setattr(ModbusDevice, "read_all", read_and_lose)

    async def main() -> None:
        clock = SystemClock()
        room = Room(tmp_path, MemoryNetwork().bus("c", "tokyo", clock), clock)
        unit = asyncio.create_task(room.unit.run())
        try:
            await run_device(room.device, room.bus, clock)
        finally:
            unit.cancel()
            await asyncio.gather(unit, return_exceptions=True)

    asyncio.run(main())
    assert reads == 3


def test_a_device_that_is_no_delay_unit_is_named_as_such(tmp_path: Path) -> None:
    registers = dict(DELAY_UNIT) | {"magic": Register("input", 1)}
    device = Device("delay", "sim", tmp_path / "unit", 1, registers, delay_channel=1)

    async def play(room: Room) -> None:
        fault = await room.until(lambda s: s.state == S.STATE_FAULT)
        assert "no delay unit of this map" in fault.detail

    with_room(tmp_path, play, device)


AMPLIFIER = {
    "volume": Register("holding", 4, unit="%", low=0.0, high=99.0),
    "mute": Register("coil", 2, "bit"),
    "power": Register("coil", 0, "bit"),
    "treble": Register("holding", 120, "i16", 0.5, "dB", -12.0, 12.0),
}
PROJECTOR = {
    "power": Register("coil", 16, "bit"),
    "shutter": Register("coil", 17, "bit"),
    "brightness": Register("holding", 0),
    "hours": Register("input", 40, "u32", unit="h"),
    "lamp_fault": Register("discrete", 3, "bit"),
}


def shows(**values: float) -> Callable[[EquipmentStatus], bool]:
    def check(status: EquipmentStatus) -> bool:
        observed = {v.name: v.observed for v in status.values}
        return status.state == S.STATE_OBSERVED and all(observed.get(n) == v for n, v in values.items())

    return check


def test_an_amplifier_holds_the_volume_of_the_file_obeys_and_has_it_again_after_it_was_off(tmp_path: Path) -> None:
    device = Device("delay", "sim", tmp_path / "unit", 1, AMPLIFIER, settings={"volume": 40.0, "power": 1.0, "treble": -3.5})

    async def play(room: Room) -> None:
        await room.until(shows(volume=40.0, power=1.0, mute=0.0, treble=-3.5))
        room.ask(volume=55.0, mute=1.0)
        await room.until(shows(volume=55.0, mute=1.0))
        assert room.unit.holds("volume") == 55.0
        room.set_fault("unplug")
        await room.until(lambda s: s.state == S.STATE_UNKNOWN)
        assert room.unit.holds("volume") == 55.0
        room.unit.set_faults()
        await room.until(shows(volume=55.0, power=1.0, mute=1.0, treble=-3.5))
        assert room.status.reconnects >= 1

    with_room(tmp_path, play, device, registers=AMPLIFIER)


def test_a_projector_on_a_serial_line_is_switched_and_its_shutter_closed(tmp_path: Path) -> None:
    device = Device("delay", "sim:rtu", tmp_path / "unit", 1, PROJECTOR, baud=9600, settings={"power": 1.0})

    async def play(room: Room) -> None:
        await room.until(shows(power=1.0, shutter=0.0, hours=0.0, lamp_fault=0.0))
        room.ask(shutter=1.0)
        await room.until(shows(power=1.0, shutter=1.0))
        room.ask(power=0.0)
        await room.until(shows(power=0.0, shutter=1.0))

    with_room(tmp_path, play, device, baud=9600, registers=PROJECTOR)


def test_a_register_that_the_device_does_not_have_is_named(tmp_path: Path) -> None:
    wrong = AMPLIFIER | {"balance": Register("holding", 5, "i16")}
    device = Device("delay", "sim", tmp_path / "unit", 1, wrong, settings={"balance": 3.0})

    async def play(room: Room) -> None:
        fault = await room.until(lambda s: s.state == S.STATE_FAULT)
        assert "balance" in fault.detail
        assert "no such register" in fault.detail

    with_room(tmp_path, play, device, registers=AMPLIFIER)


def test_a_ramp_of_the_delay_line_does_not_click() -> None:
    tone = np.sin(2 * np.pi * 300.0 * np.arange(RATE) / RATE).astype(np.float32)

    def steepest(ramp: float) -> float:
        line = DelayLine()
        out = np.concatenate(
            [line.process(tone[k : k + 960], 0.051 if k > 9600 else 0.0, ramp, 0.001) for k in range(0, RATE, 960)]
        )
        assert np.allclose(out[480:9600], tone[432:9552], atol=1e-3)  # its own millisecond
        if ramp == 0.0:
            assert np.allclose(out[-9600:], tone[-9600 - 2496 : -2496], atol=1e-3)  # and the 51 that were asked for
        else:
            assert line.actual_s == pytest.approx(0.05 * (RATE - 10560) / RATE)
            assert out[-9600:].std() == pytest.approx(tone.std(), rel=0.01)
        return float(np.abs(np.diff(out[960:])).max())

    smooth = float(np.abs(np.diff(tone)).max())
    assert steepest(0.05) < 1.1 * smooth
    assert steepest(0.0) > 1.4 * smooth

"""The delay service against a simulated delay unit over Modbus TCP: what is asked, what is heard, what goes wrong."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vistel.protocol.equipment import DELAY_UNIT, Register
from vistel.v1.audio_pb2 import EquipmentRequest, EquipmentStatus
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.delay import Config, Device, run
from vistel_sim.delay_unit import OWN_LATENCY, RATE, DelayLine, SimulatedDelayUnit
from vistel_sim.faults import Fault, Kind

S = EquipmentStatus


class Room:
    """A unit, the service that keeps it, and what it says."""

    def __init__(self, folder: Path, bus: MemoryBus, clock: SystemClock, device: Device | None = None) -> None:
        self.clock, self.bus, self.start_ns = clock, bus, clock.now_ns()
        self.unit = SimulatedDelayUnit("unit", folder / "unit", clock, self.start_ns)
        self.device = device or Device("delay", "sim", folder / "unit", 1, DELAY_UNIT, delay_channel=1)
        self._status = bus.subscribe(BY_NAME["equipment_status"])
        self.status = S()

    def ask(self, **settings: float) -> None:
        request = EquipmentRequest(equipment="delay")
        for name, value in settings.items():
            request.settings.add(name=name, value=value)
        self.bus.publish(BY_NAME["equipment_request"], equipment="delay").put(request)

    def strike(self, kind: Kind) -> None:
        self.unit.strike(Fault("unit", kind, (self.clock.now_ns() - self.start_ns) * 1e-9 - 0.001, 60.0))

    async def until(self, wanted: Callable[[EquipmentStatus], bool]) -> EquipmentStatus:
        async with asyncio.timeout(30):
            while True:
                for sample in self._status.take():
                    self.status = sample.message
                    if wanted(self.status):
                        return self.status
                await asyncio.sleep(0.02)


def with_room(tmp_path: Path, play: Callable[[Room], Coroutine[Any, Any, None]], device: Device | None = None) -> None:
    async def main() -> None:
        clock = SystemClock()
        room = Room(tmp_path, MemoryNetwork().bus("c", "tokyo", clock), clock, device)
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


def test_a_unit_goes_to_what_is_asked_says_what_it_does_and_is_heard_to_do_it(tmp_path: Path) -> None:
    async def play(room: Room) -> None:
        await room.until(holds(0.0))
        room.ask(delay=0.02)
        await room.until(holds(0.02))
        click = np.zeros(4800, np.float32)
        click[100] = 1.0
        heard = room.unit.hear(0, click)
        assert int(np.argmax(heard)) - 100 == pytest.approx((0.02 + 1e-4 * OWN_LATENCY) * RATE, abs=1)

    with_room(tmp_path, play)


@pytest.mark.parametrize("kind", ["stall", "cut"])
def test_without_good_answers_for_a_second_the_delay_is_unknown_until_they_return(tmp_path: Path, kind: Kind) -> None:
    async def play(room: Room) -> None:
        room.ask(delay=0.01)
        await room.until(holds(0.01))
        room.strike(kind)
        lost = await room.until(lambda s: s.state == S.STATE_UNKNOWN)
        assert not lost.delay_known
        assert "busy" in lost.detail if kind == "cut" else "no answer" in lost.detail
        room.unit.strike()
        back = await room.until(holds(0.01))
        assert back.reconnects >= 1

    with_room(tmp_path, play)


def test_a_unit_that_comes_back_at_its_defaults_is_given_its_settings_again(tmp_path: Path) -> None:
    async def play(room: Room) -> None:
        room.ask(delay=0.015)
        await room.until(holds(0.015))
        room.strike("unplug")
        await room.until(lambda s: s.state == S.STATE_UNKNOWN)
        room.unit.strike()
        await room.until(holds(0.015))

    with_room(tmp_path, play)


def test_exceptions_are_a_fault_with_their_meaning_and_end_when_the_unit_does_well(tmp_path: Path) -> None:
    async def play(room: Room) -> None:
        await room.until(holds(0.0))
        room.strike("garbage")
        fault = await room.until(lambda s: s.state == S.STATE_FAULT)
        assert "exception 4" in fault.detail
        assert not fault.delay_known
        assert fault.refusals >= 1
        room.unit.strike()
        await room.until(holds(0.0))

    with_room(tmp_path, play)


def test_requests_that_make_no_sense_are_told_and_left_out(tmp_path: Path) -> None:
    async def play(room: Room) -> None:
        room.ask(delay=3.0, actual_1=0.1, nonsense=1.0)
        told = await room.until(lambda s: bool(s.detail) and s.state == S.STATE_OBSERVED)
        assert "nonsense" in told.detail
        room.ask(delay=0.01)
        await room.until(lambda s: s.delay_known and s.acoustic_s > 0.01)

    with_room(tmp_path, play)


def test_a_device_that_is_no_delay_unit_is_named_as_such(tmp_path: Path) -> None:
    registers = dict(DELAY_UNIT) | {"magic": Register("input", 1)}
    device = Device("delay", "sim", tmp_path / "unit", 1, registers, delay_channel=1)

    async def play(room: Room) -> None:
        fault = await room.until(lambda s: s.state == S.STATE_FAULT)
        assert "no delay unit of this map" in fault.detail

    with_room(tmp_path, play, device)


def test_other_equipment_is_kept_by_a_map_of_ones_own(tmp_path: Path) -> None:
    registers = {"volume": Register("holding", 9, "i16", 0.1, "dB"), "power": Register("coil", 9, "bit")}
    device = Device("delay", "sim", tmp_path / "unit", 1, registers, settings={"volume": -6.0})

    async def play(room: Room) -> None:
        await room.until(lambda s: any(v.name == "volume" and v.observed == -6.0 for v in s.values))
        room.ask(power=1.0)
        await room.until(lambda s: any(v.name == "power" and v.observed == 1.0 for v in s.values))

    with_room(tmp_path, play, device)


def test_a_ramp_of_the_delay_line_does_not_click() -> None:
    tone = np.sin(2 * np.pi * 300.0 * np.arange(RATE) / RATE).astype(np.float32)

    def steepest(ramp: float) -> float:
        line = DelayLine()
        out = [line.process(tone[k : k + 960], 0.05 if k > 9600 else 0.0, ramp, 0.001) for k in range(0, RATE, 960)]
        return float(np.abs(np.diff(np.concatenate(out)[960:])).max())

    smooth = float(np.abs(np.diff(tone)).max())
    assert steepest(0.05) < 1.1 * smooth


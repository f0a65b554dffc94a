"""What the audio service asks of a site's delay unit."""

from __future__ import annotations

import asyncio

from vistel.v1.audio_pb2 import EquipmentStatus
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.audio.unit import DelayUnit


def test_no_more_is_asked_of_a_unit_than_it_can_however_late_the_pictures_are() -> None:
    async def asked_of_it() -> list[float]:
        bus = MemoryNetwork().bus("c", "tokyo", SystemClock())
        unit, requests = DelayUnit(bus, "delay", "tokyo"), bus.subscribe(BY_NAME["equipment_request"])
        status = EquipmentStatus(equipment="delay", delay_known=True)
        status.values.add(name="max_delay", observed=2.0)
        bus.publish(BY_NAME["equipment_status"], equipment="delay").put(status)
        unit.take()
        for n in range(100):
            unit.request(8.5, n * 100_000_000)
        return [s.message.settings[0].value for s in requests.take()]

    asked = asyncio.run(asked_of_it())
    assert asked and max(asked) <= 2.0

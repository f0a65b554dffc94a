"""The room's equipment on Modbus: delay units, amplifiers, projectors; what is asked of them and what they do."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from vistel_services.delay.config import Config, Device, configure

if TYPE_CHECKING:
    from vistel.wire.bus import Bus
    from vistel.wire.clock import Clock

__all__ = ["Config", "Device", "configure", "run"]


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """One task per device, until cancelled; at a site without equipment, nothing."""
    if not config.devices:
        return
    from vistel_services.delay.service import run_device  # a site without equipment need not load it

    async with asyncio.TaskGroup() as group:
        for device in config.devices:
            group.create_task(run_device(device, bus, clock), name=device.name)

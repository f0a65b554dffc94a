"""The equipment of a site on Modbus: delay units, amplifiers, projectors. Desired values are written, observed ones published."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from vistel_services.delay.config import Config, Device, configure

if TYPE_CHECKING:
    from vistel.wire.bus import Bus
    from vistel.wire.clock import Clock

__all__ = ["Config", "Device", "configure", "run"]


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """Runs one task per device, until cancelled."""
    if not config.devices:
        return
    from vistel_services.delay.service import run_device  # not needed at a site without equipment

    async with asyncio.TaskGroup() as group:
        for device in config.devices:
            group.create_task(run_device(device, bus, clock), name=device.name)

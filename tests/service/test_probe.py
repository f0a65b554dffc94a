"""Whatever hangs on a serial port is named when it is asked."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from device_site import HAND, pose, quiet_fastrak, quiet_glove, run
from virtual_time import LoopClock

from vistel_cli.devices import _answer
from vistel_sim.device import SimulatedDevice
from vistel_sim.fivedt import Glove5, Glove16, Ultra
from vistel_sim.liberty import Liberty


@pytest.mark.parametrize(
    ("unit", "name"),
    [
        (quiet_fastrak, "a Polhemus FASTRAK"), (lambda: Liberty(pose), "a Polhemus LIBERTY"),
        (lambda: Liberty(pose, model="patriot"), "a Polhemus PATRIOT"), (quiet_glove, "a CyberGlove"),
        (lambda: Ultra(lambda t: HAND), "a 5DT Data Glove Ultra"), (lambda: Glove16(lambda t: HAND), "a 5DT Data Glove 16"),
        (lambda: Glove5(lambda t: HAND), "a 5DT Data Glove 5"),
    ],
)  # fmt: skip
def test_each_device_is_named(tmp_path: Path, unit, name: str) -> None:
    async def scenario() -> None:
        clock = LoopClock()
        device = SimulatedDevice("unit", unit(), tmp_path / "unit", clock, clock.now_ns())
        task = asyncio.create_task(device.run())
        try:
            async with asyncio.timeout(20):
                while not device.port.plugged:
                    await asyncio.sleep(0.01)
                assert (await _answer(str(tmp_path / "unit"))).startswith(name)
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    run(scenario())


def test_a_port_that_is_not_there_is_told() -> None:
    async def scenario() -> None:
        assert "is not there" in await _answer("/dev/no-such-port")

    run(scenario())

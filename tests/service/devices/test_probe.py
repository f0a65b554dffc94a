"""Whatever hangs on a serial port is named when it is asked."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from device_site import HAND, pose, quiet_fastrak, quiet_glove, run
from virtual_time import LoopClock
from waiting import until

from vistel_cli.devices.devices import _answer
from vistel_sim.device import SimulatedDevice
from vistel_sim.fivedt import Glove5, Glove16, Ultra
from vistel_sim.liberty import Liberty

FASTRAK = "2.08, OutputCompensat CPG2030-003-10"
LIBERTY = "Polhemus Inc. LIBERTY, simulated Firmware 2.2"


@pytest.mark.parametrize(
    ("unit", "name", "firmware", "rate"),
    [
        (quiet_fastrak, "a Polhemus FASTRAK", FASTRAK, "30 Hz, 4 receivers"),
        (lambda: quiet_fastrak(receivers=(1, 2)), "a Polhemus FASTRAK", FASTRAK, "60 Hz, 2 receivers"),
        (lambda: Liberty(pose), "a Polhemus LIBERTY", LIBERTY, "120 Hz each"),
        (lambda: Liberty(pose, model="patriot"), "a Polhemus PATRIOT", LIBERTY.replace("LIBERTY", "PATRIOT"), "60 Hz each"),
        (quiet_glove, "a CyberGlove", "CyberGlove 18 sensors, simulated", "100 Hz, 18 sensors"),
        (lambda: Ultra(lambda t: HAND), "a 5DT Data Glove Ultra", "", "75 Hz"),
        (lambda: Glove16(lambda t: HAND), "a 5DT Data Glove 16", "", "50 Hz"),
        (lambda: Glove5(lambda t: HAND), "a 5DT Data Glove 5", "1.2", ""),
    ],
)
def test_each_device_is_named_with_firmware_and_rate(tmp_path: Path, unit, name: str, firmware: str, rate: str) -> None:
    async def scenario() -> None:
        clock = LoopClock()
        device = SimulatedDevice("unit", unit(), tmp_path / "unit", clock, clock.now_ns())
        task = asyncio.create_task(device.run())
        try:
            async with asyncio.timeout(20):
                await until(lambda: device.port.plugged)
                found = await _answer(str(tmp_path / "unit"))
                assert found["description"].startswith(name)
                assert found["firmware"] == firmware
                # A stream's own rate is counted for a second, and a line at 19200 baud carries an odd record of another kind.
                hz, _, rest = found["rate"].partition(" Hz")
                assert rest == rate.partition(" Hz")[2] and (not hz or abs(float(hz) - float(rate.partition(" Hz")[0])) <= 2)
                assert bool(found["rate"]) == bool(rate)
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    run(scenario())


def test_a_port_that_is_not_there_is_reported() -> None:
    async def scenario() -> None:
        assert "is not there" in (await _answer("/dev/no-such-port"))["description"]

    run(scenario())

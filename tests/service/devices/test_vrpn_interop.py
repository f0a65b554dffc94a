"""VRPN's own FASTRAK driver, written by others against real units, reads the simulated one."""

from __future__ import annotations

import asyncio
import itertools
import re
import shutil
from pathlib import Path

import pytest

from vistel.wire.clock import SystemClock
from vistel.wire.zenoh.endpoints import free_port
from vistel_sim.device import SimulatedDevice
from vistel_sim.fastrak import Fastrak

SERVER, CLIENT = shutil.which("vrpn_server"), shutil.which("vrpn_print_devices")
REPORT = re.compile(r"sensor (\d):\s+pos \(\s*(\S+),\s*(\S+),\s*(\S+)\)")


def still(station: int, t_s: float):
    return (0.2 + 0.1 * station, 0.05 * station, -0.30), (0.0, 0.0, 0.0, 1.0)


@pytest.mark.slow
@pytest.mark.skipif(SERVER is None or CLIENT is None, reason="vrpn_server and vrpn_print_devices are not installed")
def test_vrpn_reads_four_stations_in_inches(tmp_path: Path) -> None:
    async def scenario() -> None:
        assert SERVER and CLIENT
        clock = SystemClock()
        unit = Fastrak(still, position_noise=0.0, angle_noise=0.0)
        device = SimulatedDevice("unit", unit, tmp_path / "unit", clock, clock.now_ns())
        simulation = asyncio.create_task(device.run())
        (tmp_path / "vrpn.cfg").write_text(f"vrpn_Tracker_Fastrak\tTracker0\t{tmp_path / 'unit'}\t115200\n")
        port = free_port()
        quiet = asyncio.subprocess.DEVNULL
        server = await asyncio.create_subprocess_exec(
            SERVER, "-NIC", "127.0.0.1", "-f", str(tmp_path / "vrpn.cfg"), "-millisleep", "1", str(port), stdout=quiet, stderr=quiet
        )
        client = await asyncio.create_subprocess_exec(
            "stdbuf", "-oL", CLIENT, f"Tracker0@tcp://127.0.0.1:{port}", stdout=asyncio.subprocess.PIPE, stderr=quiet
        )
        assert client.stdout is not None
        seen: list[tuple[int, tuple[float, ...]]] = []
        text = ""
        try:
            while len(seen) < 80:
                text += (await client.stdout.read(4096)).decode()
                *_, last = [0, *(m.end() for m in REPORT.finditer(text))]
                seen += [(int(m[1]), tuple(map(float, m.groups()[1:]))) for m in REPORT.finditer(text)]
                text = text[last:]
        finally:
            for process in (client, server):
                process.kill()
                await process.wait()
            simulation.cancel()
            await asyncio.gather(simulation, return_exceptions=True)
        for sensor, position in seen:
            assert position == pytest.approx(still(sensor + 1, 0.0)[0], abs=0.006)
        order = [sensor for sensor, _ in seen]
        assert all((b - a) % 4 == 1 for a, b in itertools.pairwise(order))

    asyncio.run(scenario())

"""Beside a router that keeps no time, `vistel site clock` gives the conference's."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
from pathlib import Path

from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import measure_offset
from vistel.wire.zenoh.bus import Router, ZenohBus

FILE = """
name = "demo"
[bus]
mode = "routed"
endpoints = ["{endpoint}"]
[[sites]]
name = "tokyo"
[[sites.participants]]
name = "ann"
"""


def test_a_site_follows_the_clock_that_runs_beside_a_router_without_one(tmp_path: Path) -> None:
    router = Router.open()
    file = tmp_path / "conference.toml"
    file.write_text(FILE.format(endpoint=router.endpoint))

    async def play() -> None:
        clock = SystemClock()
        tokyo = await ZenohBus.open(conference="demo", site="tokyo", clock=clock, endpoints=[router.endpoint])
        assert await measure_offset(tokyo, clock) is None, "nobody gives the time yet"
        keeping = subprocess.Popen([sys.executable, "-m", "vistel_cli.main", "site", "clock", str(file)], stdout=subprocess.DEVNULL)
        try:
            while await measure_offset(tokyo, clock) is None:
                assert keeping.poll() is None
            keeping.send_signal(signal.SIGTERM)
            assert await asyncio.to_thread(keeping.wait) == 0
        finally:
            keeping.kill()
            keeping.wait()
            await tokyo.close()

    try:
        asyncio.run(play())
    finally:
        router.close()

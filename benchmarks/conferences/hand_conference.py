"""A conference of real processes whose first person moves a hand at known times, on this machine's loopback."""

import asyncio
import contextlib
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.zenoh.bus import Router, ZenohBus

NAME = "latency"
MOVED_HAND = "benchmarks.conferences.moved_hand"
"""What runs the devices."""
_HEAD = 'name = "{name}"\nstandby = false\n[bus]\nmode = "routed"\nendpoints = ["{endpoint}"]\n'
_END_S = 30.0


@dataclass(frozen=True)
class HandConference:
    """bus: of the hub; file: of the conference."""

    bus: ZenohBus
    clock: SystemClock
    file: Path


@contextlib.asynccontextmanager
async def hand_conference(sections: str, nodes: Sequence[str], *devices: str) -> AsyncIterator[HandConference]:
    """It runs while this is entered. sections: of its file, beside the bus; nodes: its processes, "site/label"; devices: more
    arguments of `moved_hand`."""
    router, clock = Router.open(), SystemClock()
    bus = await ZenohBus.open(conference=NAME, site="hub", clock=clock, endpoints=[router.endpoint])
    serve_clock(bus, clock)
    children: list[subprocess.Popen[bytes]] = []
    try:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "conference.toml"
            file.write_text(_HEAD.format(name=NAME, endpoint=router.endpoint) + sections)
            module = [sys.executable, "-m"]
            commands = [[*module, MOVED_HAND, str(file), "--run", folder, *devices]]
            places = ["--hub", router.endpoint, "--run", folder, "--out", folder, "--log-level", "ERROR"]
            commands += [[*module, "vistel_services.process.host", str(file), node, *places] for node in nodes]
            children += [subprocess.Popen(c, stderr=subprocess.DEVNULL, start_new_session=True) for c in commands]
            try:
                yield HandConference(bus, clock, file)
            finally:
                for child in children:
                    child.terminate()
                for child in children:
                    await asyncio.to_thread(child.wait, _END_S)
    finally:
        await bus.close()
        router.close()

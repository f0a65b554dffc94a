"""Worlds in processes of their own, each with a disk of its own, for tests that move a room between them and kill them:
python world_place.py ENDPOINT. For each line "PLACE FOLDER leads|waits" on standard input one is forked and "pid N" said.
"""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
from dataclasses import replace
from pathlib import Path

from world_site import CONFERENCE

from vistel.conference.paths import RunPaths
from vistel.space import ledger
from vistel.wire import event_loop
from vistel.wire.clock import SystemClock
from vistel_services import world
from vistel_services.world.service import warm_up


async def _live(endpoint: str, place: str, folder: Path, waits: bool) -> None:
    from vistel.wire.zenoh.bus import ZenohBus  # its threads do not outlive a fork

    clock = SystemClock()
    bus = await ZenohBus.open(conference="demo", site="hub", clock=clock, endpoints=[endpoint])
    config = replace(
        world.configure(CONFERENCE, None, RunPaths(folder, folder)), place=place, waits=waits, lease_file=folder.parent / "lease"
    )
    life = asyncio.create_task(world.run(config, bus, clock))
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, life.cancel)
    await asyncio.gather(life, return_exceptions=True)
    await bus.close()


def main() -> None:
    warm_up()
    ledger.REMEMBERED = 4096  # on a slow machine many more are answered between a question of a test and its look
    print("ready", flush=True)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    for line in sys.stdin:
        place, folder, what = line.split()
        pid = os.fork()
        if pid == 0:
            logging.basicConfig(filename=f"{folder}.log", level=logging.INFO)
            event_loop.run(_live(sys.argv[1], place, Path(folder), what == "waits"))
            os._exit(0)
        print("pid", pid, flush=True)


if __name__ == "__main__":
    main()

"""A world in a process of its own, for tests that kill it: python world_victim.py FOLDER.

Forks one world for each line on standard input and says "pid N", then "done ID" for every command that somebody was told of.
"""

from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path

from world_site import PEOPLE, START_NS, TICK_NS, WorldSite

from vistel.space import ledger
from vistel.v1.command_pb2 import Command, MoveThing
from vistel.v1.geometry_pb2 import Pose, Vec3
from vistel.wire.topics import BY_NAME
from vistel_services.world.service import warm_up


async def _live(folder: Path, life: int) -> None:
    site = WorldSite(folder)
    site.clock._now_ns = START_NS + life * 20_000_000_000
    async with site.open():
        await site.play(0.2)
        told, number = 0, 0
        while True:
            for _, who in PEOPLE:  # each as often as anybody may
                number += 1
                place = Pose(position=Vec3(x=0.001 * number % 0.3, y=0.8, z=-0.2))
                command = Command(id=f"{life}-{number}", participant=who, move=MoveThing(thing="tile", pose=place))
                command.header.t_ns = site.clock.now_ns()
                site.buses[who].publish(BY_NAME["command"], participant=who).put(command)
            for _ in range(7):
                await site.play(TICK_NS * 1e-9)
                results = site.results()
                for r in results[told:]:
                    print("done" if r.outcome == r.OUTCOME_DONE else "refused", r.id, r.step, flush=True)
                told = len(results)


def main() -> None:
    warm_up()
    ledger.REMEMBERED = 4096  # more than is answered while a slow disk keeps what was answered before
    folder = Path(sys.argv[1])
    for life, _ in enumerate(sys.stdin):
        pid = os.fork()
        if pid == 0:
            asyncio.run(_live(folder, life))
            os._exit(1)
        print("pid", pid, flush=True)
        os.waitpid(pid, 0)
        print("dead", flush=True)


if __name__ == "__main__":
    main()

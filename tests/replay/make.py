"""Makes the logs of this folder from simulated devices: `PYTHONPATH=tests python -m tests.replay.make [NAME ...]`.

Devices, their drivers and ports run in virtual time; only bytes and commands are recorded. What is computed from them is added by
`vistel replay --fast`, as when a change is accepted (`scripts/replays.py`).
"""

from __future__ import annotations

import asyncio
import sys
import tempfile
from collections.abc import Coroutine, Sequence
from pathlib import Path
from typing import Any

import virtual_time
from virtual_time import LoopClock

from scripts.replays import LOGS, accept, recomputed
from vistel.conference.files import text_of
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.messages.commands import message_of
from vistel.space.commands import phrase
from vistel.wire.bus import Bus
from vistel.wire.log import LogWriter
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services import glove, tracker
from vistel_sim.device import run_devices
from vistel_sim.limbs import own_limbs
from vistel_sim.motion import open_motion
from vistel_sim.process import simulators

BEGIN_NS = 1_700_000_000_000_000_000
"""Conference time at which the loop's time is 0 [ns]."""
STARTING_S = 1.5
"""A FASTRAK answers to its set-up for so long before it sends poses [s]."""

MEETING = {
    "name": "meeting",
    "room": {"seats": 3},
    "sites": [
        {"name": "tokyo", "participants": [{"name": "aiko", "height": 1.64, "avatar": "builtin:person=aiko", "seat": 0}]},
        {"name": "columbus", "participants": [{"name": "ben", "height": 1.82, "avatar": "builtin:person=ben", "seat": 1}]},
    ],
}
"""A FASTRAK and two CyberGloves each."""
OTHERS = {
    "name": "others",
    "room": {"seats": 2},
    "sites": [
        {
            "name": "paris",
            "participants": [
                {
                    "name": "carla",
                    "height": 1.71,
                    "avatar": "builtin:person=carla",
                    "tracker": {"kind": "liberty"},
                    "gloves": {"left": {"kind": "5dt_ultra"}, "right": {"kind": "5dt_5"}},
                }
            ],
        }
    ],
}
"""A LIBERTY and gloves of 5DT."""
REFUSED = ("paint table blue", "paint unicorn blue")
"""Lines that the world refuses: the table stands fast, and there is no unicorn."""
RECORDINGS = {"meeting": (MEETING, 5.0, ("move the yellow ball left 10 cm", *REFUSED)), "others": (OTHERS, 4.0, REFUSED)}
"""Conferences, how many seconds of each, and what the first participant types halfway."""


async def _record(conference: Conference, seconds: float, lines: Sequence[str], file: Path) -> None:
    clock, network = LoopClock(BEGIN_NS), MemoryNetwork()
    begin_ns = clock.now_ns()
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder:
        paths = RunPaths(Path(folder), Path(folder))
        bus = network.bus(conference.name, "hub", clock, None)
        recorded = [bus.subscribe(BY_NAME[name], queue_all=True, polled=True) for name in ("device_raw", "command")]
        limbs = own_limbs(conference)
        devices = simulators(conference, open_motion(conference, limbs), paths, clock, begin_ns, limbs=limbs)
        work: list[Coroutine[Any, Any, None]] = [run_devices(devices)]
        for site in conference.sites:
            own = network.bus(conference.name, site.name, clock, None)
            work += [s.run(s.configure(conference, site, paths), own, clock) for s in (tracker, glove)]
        tasks = [asyncio.create_task(w) for w in work]
        await clock.sleep_until_ns(begin_ns + round((STARTING_S + 0.5 * seconds) * 1e9))
        first = conference.sites[0]
        _ask(network.bus(conference.name, first.name, clock, None), first.participants[0].name, lines, clock.now_ns())
        await clock.sleep_until_ns(begin_ns + round((STARTING_S + seconds) * 1e9))
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    text = text_of(conference)
    samples = sorted((s for inbox in recorded for s in inbox.take()), key=lambda s: s.received_ns)
    with LogWriter(file, text) as writer:
        for s in samples:
            writer.write(s.topic, s.key, s.message, s.received_ns)


def _ask(bus: Bus, who: str, lines: Sequence[str], t_ns: int) -> None:
    """What somebody types, as `vistel ask` sends it."""
    commands = bus.publish(BY_NAME["command"], participant=who)
    for number, line in enumerate(lines):
        command = message_of(phrase.read(line), f"{who}-{number}", who)
        command.header.t_ns = t_ns
        commands.put(command)


def main(names: list[str]) -> None:
    """Make the logs of these names, all if none is given."""
    for name in names or RECORDINGS:
        data, seconds, lines = RECORDINGS[name]
        raw = Path(tempfile.mkdtemp()) / "raw.mcap"
        virtual_time.run(_record(Conference.model_validate(data), seconds, lines, raw))
        accept(recomputed(raw, raw.with_name("whole.mcap")), LOGS / f"{name}.mcap")
        print(name, (LOGS / f"{name}.mcap").stat().st_size)


if __name__ == "__main__":
    main(sys.argv[1:])

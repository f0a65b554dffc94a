"""All simulated devices of a conference, moved by one motion source.

python -m vistel_sim.process CONFERENCE.toml --run RUN [--site SITE] [--fault DEVICE:KIND:AT_S:FOR_S ...]
"""

import argparse
import asyncio
import logging
import signal
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from vistel.conference.device_list import devices_of, simulated_names
from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.devices import kind
from vistel.figure.avatar.proportions import Proportions
from vistel.wire import alive, background, event_loop
from vistel.wire.clock import Clock, SystemClock
from vistel_sim.device import MakePort, Simulator, run_devices
from vistel_sim.faults import Fault, fault_from_text
from vistel_sim.limbs import own_limbs
from vistel_sim.microphone import run_microphones
from vistel_sim.motion import MotionError, open_motion
from vistel_sim.motion.source import AVERAGE
from vistel_sim.ports.pty_port import PtyPort
from vistel_sim.simulation import BodyMotion, Simulation
from vistel_sim.sound import simulated_equipment, simulated_microphones

log = logging.getLogger("vistel.sim")


def simulators(
    conference: Conference,
    motion: BodyMotion,
    paths: RunPaths,
    clock: Clock,
    start_ns: int,
    *,
    site: str | None = None,
    faults: Iterable[Fault] = (),
    limbs: Mapping[str, Proportions] = AVERAGE,
    port: MakePort = PtyPort,
) -> list[Simulator]:
    """The devices whose port is "sim", of one site or of all. The motion and the times of `faults` begin at `start_ns`. limbs: of
    participants who are no average person of their height. port: makes the ports of serial devices. Raises ValueError for a fault
    of an unknown device."""
    faults, names = tuple(faults), simulated_names(conference, site)
    for fault in faults:
        if fault.device not in names:
            raise ValueError(f"fault: no simulated device {fault.device!r}; there are {', '.join(sorted(names))}")
    simulation = Simulation(conference, motion, paths, clock, start_ns, faults, limbs, port)
    return [kind.load(d.kind.simulator)(d, simulation) for d in devices_of(conference, site) if d.simulated]


async def run_simulators(
    conference: Conference,
    paths: RunPaths,
    clock: Clock,
    faults: Iterable[Fault] = (),
    *,
    site: str | None = None,
    start_ns: int | None = None,
    limbs: Mapping[str, Proportions] = AVERAGE,
) -> None:
    """Run all simulators until cancelled. The motion and the times of `faults` begin at `start_ns`, by default now. limbs: of
    participants who are no average person of their height."""
    motion = open_motion(conference, limbs)
    faults, start_ns = tuple(faults), clock.now_ns() if start_ns is None else start_ns
    devices = simulators(conference, motion, paths, clock, start_ns, site=site, faults=faults, limbs=limbs)
    microphones = simulated_microphones(conference, motion, paths, site=site, faults=faults)
    units = simulated_equipment(conference, paths, clock, start_ns, site=site, faults=faults)
    log.info("simulated devices=%s", ",".join(d.name for d in (*devices, *microphones, *units)))
    async with asyncio.TaskGroup() as group:
        group.create_task(run_devices((*devices, *units)))
        group.create_task(run_microphones(microphones, clock, start_ns))


async def _main(conference: Conference, paths: RunPaths, site: str | None, faults: list[Fault], alive_file: Path | None) -> None:
    limbs = own_limbs(conference)
    work = asyncio.current_task()
    assert work is not None
    for signum in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(signum, work.cancel)
    try:
        async with background.service("simulators") as beside:
            if alive_file is not None:
                beside.start(alive.report(alive_file), "sign of life")
            await run_simulators(conference, paths, SystemClock(), faults, site=site, limbs=limbs)
    except asyncio.CancelledError:
        log.info("simulated devices stopped")


def main(arguments: Sequence[str] | None = None) -> int:
    """Simulate the devices that `arguments` (default: the command line) name, until a signal. Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conference", type=Path)
    parser.add_argument("--run", type=Path, required=True, help="folder for the ports")
    parser.add_argument("--site", help="only this site's devices")
    parser.add_argument("--alive", type=Path, help="file of signs of life, for the supervisor")
    parser.add_argument("--fault", action="append", default=[], help="DEVICE:KIND:AT_S:FOR_S, may be given often")
    parser.add_argument("--quiet", action="store_true", help="log warnings and errors only")
    args = parser.parse_args(arguments)
    level = logging.WARNING if args.quiet else logging.INFO
    logging.basicConfig(force=True, level=level, format="%(asctime)s %(levelname)s %(name)s %(message)s")
    try:
        faults = [fault_from_text(text) for text in args.fault]
        event_loop.run(_main(load(args.conference), RunPaths(args.run, args.run), args.site, faults, args.alive))
    except (ConferenceError, MotionError, ValueError) as e:
        print(e, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

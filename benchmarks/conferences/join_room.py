"""The processes `bench_join` starts: `python -m benchmarks.conferences.join_room world|people ENDPOINT PEOPLE THINGS FOLDER`."""

import asyncio
import sys
from pathlib import Path

import numpy as np

from benchmarks.conferences.world_steps import MOVING, LoadedWorld, WorldLoad
from vistel.figure.posture.posture import Posture
from vistel.v1.command_pb2 import Command, MoveThing
from vistel.v1.geometry_pb2 import Pose, Quaternion, Vec3
from vistel.v1.motion_pb2 import Participant
from vistel.wire import event_loop
from vistel.wire.clock import SystemClock
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import ZenohBus
from vistel_services import world

CONFERENCE = "join"
FRAME_S = 1.0 / 60.0
FALL_S = 4.0
"""How long a thing that was lifted moves."""


async def _world(endpoint: str, load: WorldLoad, folder: Path) -> None:
    clock = SystemClock()
    bus = await ZenohBus.open(conference=CONFERENCE, site="hub", clock=clock, endpoints=[endpoint])
    room = LoadedWorld(load).world
    await world.run(world.Config(room.seats, folder, room.extras), bus, clock)


async def _people(endpoint: str, load: WorldLoad) -> None:
    """Everybody moves sixty times a second, and lifts things, so that a tenth of them is on the move."""
    clock, scene = SystemClock(), LoadedWorld(load)
    loops: dict[str, list[Posture]] = scene._loop  # pyright: ignore[reportPrivateUsage]
    loose = [t for t in scene.world.things_now if not t.fixed]
    buses = {who: await ZenohBus.open(conference=CONFERENCE, site=f"at-{who}", clock=clock, endpoints=[endpoint]) for who in loops}
    encoders = {who: MotionEncoder() for who in loops}
    for who, bus in buses.items():
        bus.announce("process-capture")
        about = Participant(participant=who, site=bus.site, display_name=who, avatar="builtin", height_m=1.75)
        bus.publish(BY_NAME["participant"], participant=who).put(about)
    rng, asked = np.random.default_rng(1), 0
    due_s = asyncio.get_running_loop().time()
    for k in range(1 << 30):
        for who, loop in loops.items():
            p, out = loop[k % len(loop)], buses[who].publish(BY_NAME["motion"], participant=who)
            stance = np.array([*p.stance.position, p.stance.heading])
            out.put(encoders[who].encode(MotionSample(out.next_seq, clock.now_ns(), p.dofs, p.hands, stance, p.gaze)))
        while asked < k * FRAME_S * MOVING * len(loose) / FALL_S:
            asked += 1
            thing, who = loose[int(rng.integers(len(loose)))], sorted(loops)[asked % len(loops)]
            x, y, z = (thing.position + np.array([0.0, 0.3, 0.0])).tolist()
            pose = Pose(position=Vec3(x=x, y=y, z=z), rotation=Quaternion(w=1.0))
            command = Command(id=f"c{asked}", participant=who, move=MoveThing(thing=thing.id, pose=pose))
            command.header.t_ns = clock.now_ns()
            buses[who].publish(BY_NAME["command"], participant=who).put(command)
        due_s = max(due_s + FRAME_S, asyncio.get_running_loop().time() - 0.1)
        await asyncio.sleep(max(0.0, due_s - asyncio.get_running_loop().time()))


def main() -> None:
    """Until killed."""
    what, endpoint, people, things, folder = sys.argv[1:]
    load = WorldLoad(int(people), int(things))
    event_loop.run(_world(endpoint, load, Path(folder)) if what == "world" else _people(endpoint, load))


if __name__ == "__main__":
    main()

"""How long a room stands still when another world takes it over, and how long a late joiner waits for it.

Processor time of all that lies between the last step of one world and the first of the next, but for the way of the bytes:
the state written, packed, unpacked, read, and its things weighed where they are not known yet.
"""

import time
from collections.abc import Iterator

import numpy as np

from benchmarks.conferences.world_steps import LoadedWorld, WorldLoad
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.messages.world.encode import world_state
from vistel.persistence import journal
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldHandover, WorldSnapshot
from vistel_services.world.room import inputs_message

TICK_MS = 1000.0 / 60.0
TIMES = 15
"""How often each is measured; a third as often in the short form."""


def rows(thorough: bool) -> Iterator[Row]:
    """A hand-over, a restart, a late joiner, a step's record in the journal, for a small and a large room."""
    for people, things in ((3, 50), (20, 500)):
        case, times = f"{people} people, {things} things", TIMES if thorough else TIMES // 3
        scene = LoadedWorld(WorldLoad(people, things))
        with part(f"life: {case}", 90) as done:
            for _ in range(90):
                scene.step()
                done()
        ready = World.restore(scene.world.snapshot())
        moved = _least(lambda scene=scene, ready=ready: _hand_over(scene, ready), times)
        yield Row("world", case, "hand-over", "ms", moved, target=at_most(TICK_MS))
        cold = _least(lambda scene=scene: World.restore(scene.world.snapshot()), times)
        yield Row("world", case, "read from disk", "ms", cold)
        view = scene.take(scene.inputs())
        late = _least(lambda scene=scene, view=view: _late(scene, view), times)
        yield Row("world", case, "late joiner", "ms", late, target=at_most(500))
        inputs = scene.inputs()
        kept = _least(lambda inputs=inputs: journal.record(inputs_message(inputs), inputs), times)
        yield Row("world", case, "journal, per step", "ms", kept)
        size = len(journal.record(inputs_message(inputs), inputs)) * 60 / 1000
        yield Row("world", case, "journal", "kB/s", size)


def _hand_over(scene: LoadedWorld, ready: World) -> None:
    packed = WorldHandover(private_state=scene.world.snapshot(), term=1).SerializeToString()
    World.restore(WorldHandover.FromString(packed).private_state, like=ready)


def _late(scene: LoadedWorld, view: object) -> None:
    packed = WorldSnapshot(private_state=scene.world.snapshot(), state=world_state(view)).SerializeToString()  # type: ignore[arg-type]
    WorldSnapshot.FromString(packed)


def _least(what: object, count: int) -> float:
    times: list[float] = []
    for _ in range(count):
        began = time.thread_time()
        what()  # type: ignore[operator]
        times.append((time.thread_time() - began) * 1e3)
    return float(np.min(times))

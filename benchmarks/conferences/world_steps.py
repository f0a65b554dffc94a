"""How long steps of the world take: people who talk, gesture and hand things over, things that lie and a tenth of which fly.

Processor time of the stepping thread.
"""

import gc
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.arrays import F64
from vistel.conference.model import Conference
from vistel.figure.posture.posture import Posture, Stance
from vistel.geometry.rotation import rotation_y
from vistel.space.actions import Move
from vistel.space.arguments import Which
from vistel.space.inputs import CommandInput, MotionInput, ParticipantBody, StepInputs
from vistel.space.room import Extra, Room, meeting_room, seat_pose, table_radius
from vistel.space.things.things import Thing
from vistel.space.view import WorldView
from vistel.space.world import World
from vistel_services.world.service import warm_up
from vistel_sim.motion.meeting import Meeting
from vistel_sim.motion.source import simulated_people

STEP_NS = 16_666_667
LOOP = 600
"""Steps after which everybody begins again."""
MOVING = 0.1
"""Share of the things that is on the move."""
LASTS_S = 4.0
"""How long a thing that was dropped rolls and is awake."""
TARGETS = {(3, 50): at_most(4), (20, 500): at_most(16)}
"""Milliseconds at the 99th percentile, by people and things."""
EXPONENT = at_most(1.2)
PEOPLE, THINGS = (3, 6, 12, 24), (50, 100, 200, 400, 800)
"""Sizes over which growth is fitted, with 50 things and with 3 people; the last of many things takes long to set up."""
PYTHON_LOOP = 3_000_000


@dataclass(frozen=True)
class WorldLoad:
    """people, things (loose ones); steps: how many are measured, after as many as `settle`; seats: of the room, at least."""

    people: int
    things: int
    steps: int = 600
    settle: int = 120
    seats: int = 0

    @property
    def name(self) -> str:
        return f"{self.people} people, {self.things} things"


def rows(thorough: bool) -> Iterator[Row]:
    """Step times under two loads, and how they grow."""
    times = 3 if thorough else 2
    with part("kernels"):
        warm_up()
    yield Row("world", "this machine now", "fixed loop of Python", "s", python_loop())
    for (people, things), target in TARGETS.items():
        load = WorldLoad(people, things)
        ms, size = measure(load, times)
        for name, share in (("p50", 50), ("p90", 90), ("p99", 99), ("max", 100)):
            value = float(np.percentile(ms, share))
            yield Row("world", load.name, f"step {name}", "ms", value, target=target if name == "p99" else None)
        yield Row("world", load.name, "state", "kB", size / 1000)
    steps, settle = (480, 120) if thorough else (180, 60)
    grown = {
        "people": [WorldLoad(n, 50, steps, settle) for n in PEOPLE],
        "things": [WorldLoad(3, n, steps, settle) for n in (THINGS if thorough else THINGS[:-1])],
    }
    for what, loads in grown.items():
        yield from growth(what, loads, times)


def growth(what: str, loads: list[WorldLoad], times: int) -> Iterator[Row]:
    """Median and 99th percentile of each size, and the slopes of straight lines through them, both axes logarithmic."""
    found: dict[str, list[float]] = {"p50": [], "p99": []}
    for load in loads:
        ms, _ = measure(load, times)
        for name, values in found.items():
            values.append(float(np.percentile(ms, int(name[1:]))))
            yield Row("world", f"growth: {load.name}", f"step {name}", "ms", values[-1])
    count = np.log([load.people if what == "people" else load.things for load in loads])
    for name, values in found.items():
        every = float(np.polyfit(count, np.log(values), 1)[0])
        last = float(np.diff(np.log(values[-2:]))[0] / np.diff(count[-2:])[0])
        case = f"growth in {what}"
        yield Row("world", case, f"exponent of {name}", "", every, target=EXPONENT)
        yield Row("world", case, f"of the last two, {name}", "", last)


def python_loop() -> float:
    """Seconds of processor time that a fixed loop takes: how fast the machine is just now."""
    began, x = time.process_time(), 0
    for i in range(PYTHON_LOOP):
        x += i * i
    return time.process_time() - began


@cache
def measure(load: WorldLoad, times: int) -> tuple[F64, int]:
    """(steps,) milliseconds of processor time, and bytes of the state.

    The same steps are taken `times` times, which gives the same states, and the least time of each counts: what else runs
    on the machine slows down now this step and now that one. What has been loaded before is kept from the collector of
    garbage, as the server does from which worlds are forked.
    """
    least = np.full(load.steps, np.inf)
    size = 0
    for turn in range(times):
        scene = LoadedWorld(load)
        gc.collect()
        gc.freeze()
        with part(f"{load.name}, {turn + 1} of {times}", load.settle + load.steps) as done:
            for _ in range(load.settle):
                scene.step()
                done()
            for i in range(load.steps):
                inputs = scene.inputs()
                began = time.thread_time()
                scene.take(inputs)
                least[i] = min(least[i], (time.thread_time() - began) * 1e3)
                done()
        gc.unfreeze()
        size = len(scene.world.snapshot())
    return least, size


class LoadedWorld:
    """A world under load, the same every time."""

    def __init__(self, load: WorldLoad) -> None:
        seats = max(load.people, load.seats, _seats_for(load.things))
        room = crowded(seats, load.things)
        self.world = World(room)
        self._people = [f"p{i:02d}" for i in range(load.people)]
        self._loop = _postures(self._people, seats)
        self._loose = [t.id for t in room.things if not t.fixed]
        self._step = 0
        self._rng = np.random.default_rng(1)
        self._place = {t.id: t.position for t in room.things}

    def inputs(self) -> StepInputs:
        """What is new for the next step."""
        self._step += 1
        k = self._step
        t_ns = k * STEP_NS
        motions = tuple(MotionInput(name, self._loop[name][k % len(self._loop[name])], k, t_ns) for name in self._people)
        people = tuple(ParticipantBody(n, 1.5 + 0.5 * i / len(self._people)) for i, n in enumerate(self._people)) if k == 1 else ()
        return StepInputs(k, t_ns, people, motions, commands=tuple(self._tosses(k)))

    def take(self, inputs: StepInputs) -> WorldView:
        return self.world.step(inputs)

    def step(self) -> None:
        self.take(self.inputs())

    def _tosses(self, k: int) -> Iterator[CommandInput]:
        """Things are lifted 30 cm and fall."""
        wanted = MOVING * len(self._loose) / (60.0 * LASTS_S)
        for i in range(math.floor(k * wanted) - math.floor((k - 1) * wanted)):
            thing = self._loose[int(self._rng.integers(len(self._loose)))]
            who = self._people[(k + i) % len(self._people)]
            place = self._place[thing] + np.array([0.0, 0.3, 0.0])
            yield CommandInput(f"{k}-{i}", who, Move(Which(thing), place, np.array([0.0, 0.0, 0.0, 1.0])))


def crowded(seats: int, loose: int) -> Room:
    """A meeting room with `loose` loose things: those that are always there, and balls and bars over the table."""
    base = meeting_room(seats)
    have = [t for t in base.things if not t.fixed]
    radius = table_radius(seats) - 0.05
    spacing = min(0.14, math.sqrt(2.2 * radius * radius / max(1, loose)))
    n = math.ceil(radius / spacing)
    grid = [np.array([i * spacing, j * spacing]) for i in range(-n, n + 1) for j in range(-n, n + 1)]
    free = [p for p in grid if float(np.hypot(*p)) < radius and all(_far(p, t) > 0.11 for t in have)]
    wanted = loose - len(have)
    if len(free) < wanted:
        raise ValueError(f"things: {len(free)} of {wanted} fit on the table of {seats} seats")
    size = min(0.025, 0.3 * spacing)
    chosen = sorted(free, key=lambda p: float(np.hypot(*p)))[:wanted]
    extras = [
        Extra(f"t{i:03d}", f"thing {i}", "ball" if i % 2 else "lump", size, 0.1, 0.9, 0x888888FF, float(p[0]), float(p[1]))
        for i, p in enumerate(chosen)
    ]
    return meeting_room(seats, extras)


def _far(place: F64, thing: Thing) -> float:
    return math.hypot(place[0] - thing.position[0], place[1] - thing.position[2])


def _seats_for(things: int) -> int:
    """Seats of a room whose table holds so many things."""
    return next(n for n in range(3, 200) if 2.2 * (table_radius(n) - 0.05) ** 2 / things > 0.0072)


def _postures(names: list[str], seats: int) -> dict[str, list[Posture]]:
    """Ten seconds of everybody: the three of the made-up meeting, moved to everybody's seat and out of step."""
    played = _played()
    out: dict[str, list[Posture]] = {}
    for i, name in enumerate(names):
        own, late = played[i % 3], 97 * (i // 3)
        there, here = seat_pose(3, i % 3), seat_pose(seats, i)
        out[name] = [_moved(own[(k + late) % LOOP], there, here) for k in range(LOOP)]
    return out


@cache
def _played() -> list[list[Posture]]:
    three = [{"name": f"m{i}", "seat": i} for i in range(3)]
    conference = Conference.model_validate({"sites": [{"name": "one", "participants": three}]})
    meeting = Meeting(list(simulated_people(conference).values()), 3, 1)
    return [[meeting.posture(f"m{i}", k / 60) for k in range(LOOP)] for i in range(3)]


def _moved(posture: Posture, there: tuple[F64, float], here: tuple[F64, float]) -> Posture:
    turn = here[1] - there[1]
    position = here[0] + rotation_y(turn) @ (posture.stance.position - there[0])
    return replace(posture, stance=Stance(position, posture.stance.heading + turn))

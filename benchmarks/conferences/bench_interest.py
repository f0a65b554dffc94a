"""What a site hears of a large room: bits with more people, more things and more that moves, and how right it looks.

Each scene is a real world with people who talk and gesture; some of its things, wherever they lie, move all the time as hands of
theirs do, half of them the other way round. Messages are counted as they are put on the bus, headers
included. A receiver is a site with one person: it hears what everybody hears, and the details of that person.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.conferences.world_steps import LoadedWorld, WorldLoad
from benchmarks.row import Row, at_most
from vistel.arrays import F64
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.messages.world.encoder import WorldEncoder
from vistel.space.eyes import Eyes
from vistel.space.view import ThingView, WorldView
from vistel.v1.world_pb2 import WorldDetail, WorldState
from vistel.wire.topics import MESSAGE_VERSION
from vistel.wire.world.decoder import RoomState, WorldDecoder
from vistel_services.world.service import warm_up

ABOVE = np.array([0.0, 0.3, 0.0])
SETTLE, STEPS = 60, 300
SCENES = ((3, 50, 5), (20, 500, 100), (40, 500, 100), (20, 1000, 100), (20, 500, 200), (20, 500, 400))
"""People, things, of which move."""
KBIT, MOST_KBIT = 20.0, 64.0
SEATS = 14
"""Of the room, at least: things lie where hands seldom come, or many more would move."""
NEAR_M = 1.5
PIXEL = 1.6e-3
"""Radians of a pixel where 640 show sixty degrees."""


@dataclass
class Heard:
    """What one receiver, or nobody's, got in some seconds."""

    bits: int = 0
    most: int = 0
    millimetres: list[float] = field(default_factory=list[float])
    angles: list[float] = field(default_factory=list[float])


@dataclass
class Told:
    """One scene: with details, without them, what all details of a room are together, and what telling costs."""

    seconds: float
    site: Heard
    anybody: Heard
    all_details: int
    telling_s: float
    hearing_s: float


def run() -> Iterator[Row]:
    warm_up()
    for people, things, moving in SCENES:
        told = listen(people, things, moving)
        case = f"{people} people, {things} things, {moving} of them moving in different places"
        kbit = told.site.bits / told.seconds / 1000
        most = KBIT if things == 50 else MOST_KBIT
        yield Row("interest", case, "to a site with one person", "kbit/s", kbit, target=at_most(most))
        yield Row("interest", case, "most in one second", "kbit/s", told.site.most / 1000)
        yield Row("interest", case, "to who has nobody there", "kbit/s", told.anybody.bits / told.seconds / 1000)
        yield Row("interest", case, "from the world, all details", "kbit/s", told.all_details / told.seconds / 1000)
        for what, heard in (("with details", told.site), ("without", told.anybody)):
            for share in (50, 99):
                wrong = float(np.percentile(heard.angles, share)) / PIXEL
                yield Row("interest", case, f"looks wrong by, p{share}, {what}", "pixels", wrong)
            if heard.millimetres:
                near = float(np.percentile(heard.millimetres, 99))
                yield Row("interest", case, f"within {NEAR_M} m wrong by, p99, {what}", "mm", near)
        yield Row("interest", case, "telling, per step", "ms", told.telling_s / told.seconds / 60 * 1e3)
        yield Row("interest", case, "hearing, per second", "ms", told.hearing_s / told.seconds * 1e3)


def listen(people: int, things: int, moving: int) -> Told:
    """Some seconds of a scene."""
    scene = Carried(people, things, moving)
    encoder, site, anybody = WorldEncoder(), WorldDecoder(), WorldDecoder()
    me = "p00"
    out = Told(STEPS / 60, Heard(), Heard(), 0, 0.0, 0.0)
    seconds = np.zeros(STEPS // 60 + 1)
    for n in range(SETTLE + STEPS):
        view, eyes = scene.next()
        counted = n >= SETTLE
        began = time.thread_time()
        told = encoder.encode(view)
        details = encoder.details(eyes, view.t_ns) if told.state is not None else {}
        data = {who: _bytes(d, n) for who, d in details.items()}
        state = _bytes(told.state, n) if told.state is not None else b""
        out.telling_s += (time.thread_time() - began) * counted
        if not state:
            continue
        began = time.thread_time()
        if me in data:
            site.receive_detail(WorldDetail.FromString(data[me]))
        mine = site.read(WorldState.FromString(state))
        out.hearing_s += (time.thread_time() - began) * counted
        theirs = anybody.read(WorldState.FromString(state))
        if counted:
            bits = 8 * (len(state) + len(data.get(me, b"")))
            out.site.bits += bits
            out.anybody.bits += 8 * len(state)
            out.all_details += 8 * sum(map(len, data.values()))
            seconds[(n - SETTLE) // 60] += bits
            _compare(out.site, view, mine[-1], eyes[me])
            _compare(out.anybody, view, theirs[-1], eyes[me])
    for decoder in (site, anybody):
        if decoder.lost or decoder.missed or decoder.differed:
            raise RuntimeError("the receiver did not follow")
    out.site.most = int(seconds.max())
    return out


def _bytes(message: WorldState | WorldDetail, n: int) -> bytes:
    message.header.version, message.header.seq = MESSAGE_VERSION, n + 1
    return message.SerializeToString()


def _compare(out: Heard, view: WorldView, now: RoomState, eye: Eyes) -> None:
    for s in view.states:
        if s.moved:
            wrong = float(np.linalg.norm(now.poses[s.id][0] - s.position))
            far = max(0.25, float(np.linalg.norm(s.position - eye.position)))
            out.angles.append(wrong / far)
            if far < NEAR_M:
                out.millimetres.append(1e3 * wrong)


class Carried(LoadedWorld):
    """People who are real, and things that move as their hands do, each where it lay."""

    def __init__(self, people: int, things: int, moving: int) -> None:
        super().__init__(WorldLoad(people, things, seats=SEATS))
        ways = [_way(self._loop[who], hand) for who in sorted(self._loop)[:3] for hand in ("left_hand", "right_hand")]
        loose = [n for n, t in enumerate(self.world.things_now) if not t.fixed]
        chosen = np.random.default_rng(2).choice(loose, moving, replace=False).tolist()
        self._rows = {n: (ways[i % len(ways)], 31 * i) for i, n in enumerate(chosen)}

    def next(self) -> tuple[WorldView, dict[str, Eyes]]:
        """The next step, and from where everybody looks."""
        view = self.world.step(replace(self.inputs(), commands=()))
        states = [self._carried(n, s, view.step) if n in self._rows else s for n, s in enumerate(view.states)]
        return replace(view, states=tuple(states)), self.world.eyes

    def _carried(self, n: int, s: ThingView, step: int) -> ThingView:
        (places, turns), late = self._rows[n]
        k = (step + late) % len(places)
        side = 1.0 if n % 2 else -1.0
        return replace(s, position=s.position + side * places[k] + ABOVE, rotation=turns[k], moved=True)


def _way(postures: Sequence[Posture], hand: str) -> tuple[F64, F64]:
    """(K, 3) where a hand is, about its mean [m], and (K, 4) how it is turned."""
    joints = [pose_joints(standard_skeleton(1.75), p) for p in postures]
    places = np.array([j.position[JOINT_INDEX[hand]] for j in joints])
    turns = np.array([quaternion_from_matrix(np.ascontiguousarray(j.rotation[JOINT_INDEX[hand]])) for j in joints])
    return places - places.mean(0), turns

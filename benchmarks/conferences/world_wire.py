"""What the world's state costs on the wire: bits to each receiver, errors of what arrives, time to say it and to read it.

The same people and things as in `world_steps`. Messages are counted as they are put on the bus, headers included.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.conferences.world_steps import LASTS_S, STEP_NS, LoadedWorld, WorldLoad
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.messages.world.encoder import WorldEncoder
from vistel.render.stage.stage import Stage
from vistel.space.inputs import PropInput, StepInputs
from vistel.space.view import WorldView
from vistel.v1.world_pb2 import WorldSnapshot, WorldState
from vistel.wire.topics import MESSAGE_VERSION
from vistel.wire.world.decoder import RoomState, SnapshotBuilder, WorldDecoder
from vistel_services.world.service import warm_up

MOVING = 5
SEATS = 14
"""Of the room: things lie where the hands of three people seldom come, or many more would move."""
CROWDED = 30
SECONDS, CROWD_SECONDS = 16.0, 6.0
"""Half of these in the short form."""
KBIT, MILLIMETRES, DEGREES = at_most(20), at_most(0.5), at_most(0.1)
CROWDS = (3, 6, 12, 24)


@dataclass
class ReceiverFigures:
    """One receiver's side of some seconds."""

    seconds: float = 0.0
    bits: int = 0
    telling_s: float = 0.0
    hearing_s: float = 0.0
    millimetres: list[float] = field(default_factory=list[float])
    degrees: list[float] = field(default_factory=list[float])
    moving: list[int] = field(default_factory=list[int])
    snapshot: int = 0

    @property
    def kbit_s(self) -> float:
        return self.bits / self.seconds / 1000


def rows(thorough: bool) -> Iterator[Row]:
    """Bandwidth, errors and costs."""
    share = 1.0 if thorough else 0.5
    warm_up()
    for what, seats, led in (("led by trackers", SEATS, True), ("thrown and pushed about", 10, False)):
        heard = listen(WorldLoad(3, 50, seats=seats), led=led, seconds=share * SECONDS)
        case = f"3 people, 50 things, {np.mean(heard.moving):.1f} of them {what}"
        yield Row("world", case, "to each receiver", "kbit/s", heard.kbit_s, target=KBIT)
        for metric, unit, errors, target in (
            ("position error p99", "mm", heard.millimetres, MILLIMETRES),
            ("orientation error p99", "degrees", heard.degrees, DEGREES),
        ):
            p99 = float(np.percentile(errors, 99))
            yield Row("world", case, metric, unit, p99, target=target)
        steps = heard.seconds * 60
        yield Row("world", case, "saying it, per step", "us", heard.telling_s / steps * 1e6)
        yield Row("world", case, "hearing it, per second", "ms", heard.hearing_s / heard.seconds * 1e3)
        yield Row("world", case, "snapshot for a late joiner", "kB", heard.snapshot / 1000)
    crowds = CROWDS if thorough else CROWDS[:-1]
    rates = [listen(WorldLoad(n, 50, seats=CROWDED), seconds=share * CROWD_SECONDS).kbit_s for n in crowds]
    each = float(np.polyfit(crowds, rates, 1)[0])
    case = "50 things, people: " + ", ".join(f"{n}: {r:.1f}" for n, r in zip(crowds, rates, strict=True)) + " kbit/s"
    yield Row("world", case, "each further person", "kbit/s", each)


def listen(load: WorldLoad, *, led: bool = False, seconds: float) -> ReceiverFigures:
    """Some seconds of a world, told and heard. led: the things that move follow hands at a distance, instead of being thrown."""
    scene = _Led(load) if led else LoadedWorld(load)
    encoder, decoder, backlog, stage = WorldEncoder(), WorldDecoder(), SnapshotBuilder(), Stage(100_000_000)
    out = ReceiverFigures()
    waiting: dict[int, WorldView] = {}
    begin, end = round(LASTS_S * 60), round((LASTS_S + seconds) * 60)
    for view in _steps(scene, end, f"wire: {load.name}, {'led' if led else 'thrown'}"):
        n = view.step - 1
        began = time.thread_time()
        told = encoder.encode(view)
        out.telling_s += (time.thread_time() - began) * (n >= begin)
        waiting[view.step] = view
        if told.whole is not None:
            backlog.key(told.whole)
        if told.state is None:
            continue
        told.state.header.version, told.state.header.seq = MESSAGE_VERSION, n + 1
        backlog.add(told.state)
        data = told.state.SerializeToString()
        began = time.thread_time()
        steps = decoder.read(WorldState.FromString(data))
        for now in steps:
            stage.receive_world(now, now.t_ns)
        took = time.thread_time() - began
        if n >= begin:
            out.bits += 8 * len(data)
            out.hearing_s += took
            for now in steps:
                _compare(out, waiting.pop(now.step), now)
    if decoder.lost or decoder.missed or decoder.differed:
        raise RuntimeError("the receiver did not follow")
    out.seconds = (end - begin) / 60
    out.snapshot = len(backlog.snapshot().SerializeToString())
    if WorldDecoder().begin(WorldSnapshot.FromString(backlog.snapshot().SerializeToString())) is None:
        raise RuntimeError("a late joiner did not understand the snapshot")
    return out


def _steps(scene: LoadedWorld, count: int, name: str) -> Iterator[WorldView]:
    with part(name, count) as done:
        for _ in range(count):
            yield scene.world.step(scene.inputs())
            done()


def _compare(out: ReceiverFigures, view: WorldView, now: RoomState) -> None:
    moved = [s for s in view.states if s.moved]
    out.moving.append(len(moved))
    for s in moved:
        position, rotation = now.poses[s.id]
        out.millimetres.append(1e3 * float(np.linalg.norm(position - s.position)))
        out.degrees.append(float(np.degrees(2.0 * np.arccos(min(1.0, abs(float(rotation @ s.rotation)))))))


class _Led(LoadedWorld):
    """Things whose receivers move as hands do, beside them."""

    def inputs(self) -> StepInputs:
        plain = replace(super().inputs(), commands=())
        names = sorted(self._loop)
        props: list[PropInput] = []
        for i in range(MOVING):
            postures = self._loop[names[i % len(names)]]
            joints = pose_joints(standard_skeleton(1.75), postures[(plain.step + 31 * i) % len(postures)])
            hand = JOINT_INDEX[("left_hand", "right_hand")[i % 2]]
            place = joints.position[hand] + np.array([0.0, 0.4 + 0.1 * i, 0.0])
            turn = quaternion_from_matrix(np.ascontiguousarray(joints.rotation[hand]))
            still = np.zeros(3)
            props.append(PropInput(self._loose[-1 - i], place, turn, plain.step * STEP_NS, still, still))
        return replace(plain, props=tuple(props))

"""Other hands, things and movements than the room's: what they truly take hold of, as `grasp_trials` has it.

Two sets of the same make. The first one's closings are those of the recordings that the house's thresholds were settled on; it
may be looked at when these are worked on. The second one's are other recordings (`HELD_OUT`), of other sessions, one of them
of a left hand; it was held out, was scored once, and has been worked with since. Both have hands of 85 to 115 % of the average
size, tracking noise, gloves that are off, and things of sizes and shapes that the room does not have. A closing counts only
where the tracker itself was sure of it and the hand stays closed for as long as the world may take to find it.
"""

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.figures import grasp_trials
from benchmarks.figures.grasp_trials import CLOSED, LATE_S, OPENED, RATE_HZ, Trial, closings, hand_at, recording
from benchmarks.leap import confidence
from vistel.arrays import F64
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import quaternion_from_matrix, rotation_x
from vistel.space.people import HAND_JOINT, build_of
from vistel.space.room import TABLE_HEIGHT
from vistel.space.things.tessellate import tessellate_thing
from vistel.space.things.things import GraspAxis, Thing, ThingPrimitive

HELD_OUT = Path(os.environ["VISTEL_HELD_OUT_HANDS"]) if "VISTEL_HELD_OUT_HANDS" in os.environ else None
"""Folder of the recordings that were held out: `recorder/recordings` of leapmotion/leapjs-playback at 4ff4b5b."""
SURE = 0.5
"""The tracker's own confidence, on the average of a closing."""
SIZES = (1.49, 2.01)
"""Heights of people whose hands are 85 % and 115 % of the average [m]."""
GLOVE, OFF, TREMBLE = 0.02, 0.05, 0.0015
"""Noise of each angle in each frame, error of each angle for good [rad], noise of the place of the hand [m]."""
LEAD = 90
"""Frames of a recording before its hand is closed, at most."""
AT = np.array([-0.2, 0.0, 0.2])
"""Where on the table things stand."""


@dataclass(frozen=True)
class Take:
    """A recording and the hand in it."""

    path: Path
    left: bool = False


@dataclass(frozen=True)
class Takes:
    """What a set is made of: hands that grab, hands that pinch, hands at rest, one that points, hands that wave."""

    grabs: tuple[Take, ...]
    pinches: tuple[Take, ...]
    rest: Take
    points: Take
    waves: tuple[Take, ...]
    seed: int


def settled_on() -> Takes:
    """The recordings that thresholds were settled on."""
    take = {n: Take(grasp_trials.DATA / "hand" / "leap" / f"{n}.json.lz") for n in ("grab", "pinch", "wave", "HandSplay-110fps")}
    wave, splay = take["wave"], take["HandSplay-110fps"]
    return Takes((take["grab"],), (take["pinch"],), splay, splay, (wave, splay), 166)


def held_out(folder: Path) -> Takes:
    """The others."""

    def take(name: str, left: bool = False) -> Take:
        return Take(folder / f"{name}.json.lz", left)

    return Takes(
        (take("confidence-demo-half-res"), take("confidence2", left=True), take("test-paddle-rightwards")),
        (take("brian"),),
        take("Waiting-110fps"),
        take("gun"),
        (take("flapping"), take("three-claps"), take("rollAndPitchWithEntry")),
        977,
    )


@dataclass(frozen=True)
class _Closing:
    name: str
    fingers: F64
    closes: int
    opens: int | None


def _closings(takes: tuple[Take, ...], pinch: bool) -> Iterator[_Closing]:
    for take in takes:
        fingers, grab, pinched = recording(take.path, take.left)
        sure = confidence(take.path, RATE_HZ, take.left)
        for number, (first, closed, last, opened) in enumerate(closings(pinched if pinch else grab)):
            strength = pinched if pinch else grab
            while first > max(0, closed - LEAD) and strength[first - 1] <= OPENED:  # as much of the open hand as there is
                first -= 1  # noqa: PLW2901
            brief = opened is not None and int((strength[closed:opened] >= CLOSED).sum()) < LATE_S * RATE_HZ
            if not brief and float(sure[first : closed + 10].mean()) >= SURE:
                name = f"{take.path.name.split('.')[0]} {number + 1}"
                yield _Closing(name, fingers[first:last], closed - first, None if opened is None else opened - first)


def left_out(takes: Takes) -> int:
    """How many closings the tracker itself was not sure of, or over before they must be found."""
    some = [(t, pinch) for pinch, of in ((False, takes.grabs), (True, takes.pinches)) for t in of]
    all_of = sum(len(list(closings(recording(t.path, t.left)[2 if pinch else 1]))) for t, pinch in some)
    return all_of - sum(len(list(_closings(of, pinch))) for of, pinch in ((takes.grabs, False), (takes.pinches, True)))


def things(rng: np.random.Generator) -> list[Thing]:
    """What a hand from above can close round, in sizes drawn anew."""
    u = rng.uniform
    wide, r = u(0.015, 0.028), u(0.022, 0.034)
    tube = u(0.007, 0.011)
    cup = ThingPrimitive("superellipsoid", (r, r, u(0.03, 0.045), 0.3, 1.0), rotation=_upright())
    handle = ThingPrimitive("supertoroid", (0.006, 0.006, 0.006, 3.0, 1.0, 1.0), np.array([r + 0.010, 0.0, 0.0]))
    shaft = ThingPrimitive("cone_sphere", (-0.08, 0.0, 0.0, 0.08, 0.0, 0.0, u(0.010, 0.016), u(0.010, 0.016)))
    head = ThingPrimitive("superellipsoid", (0.018, 0.018, 0.04, 0.3, 0.3), np.array([0.11, 0.0, 0.0]))
    across = (GraspAxis(np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.013),)
    return [
        standing_thing("ball-x", ThingPrimitive("sphere", (u(0.018, 0.036),))),
        standing_thing("bar-x", ThingPrimitive("cone_sphere", (-0.07, 0.0, 0.0, 0.07, 0.0, 0.0, u(0.010, 0.02), u(0.010, 0.02)))),
        standing_thing("box-x", ThingPrimitive("superellipsoid", (u(0.04, 0.07), u(0.02, 0.04), wide, 0.2, 0.2))),
        standing_thing("egg-x", ThingPrimitive("superellipsoid", (u(0.03, 0.045), u(0.02, 0.03), u(0.02, 0.03), 1.0, 1.0))),
        standing_thing("ring-x", ThingPrimitive("supertoroid", (tube, tube, tube, u(3.0, 4.0), 1.0, 1.0), rotation=_upright())),
        standing_thing("cup-x", cup, handle),
        standing_thing("hammer-x", shaft, head, axes=across),
    ]


def _upright() -> F64:
    """The rotation that turns a primitive's Z upwards."""
    return quaternion_from_matrix(rotation_x(-0.5 * math.pi))


def standing_thing(name: str, *primitives: ThingPrimitive, axes: tuple[GraspAxis, ...] = ()) -> Thing:
    """A thing of the bench that stands on the table."""
    thing = Thing(name, name, name, primitives, 0.1, 0.0, 0, np.zeros(3), axes=axes)
    low = min(float(s.vertices[:, 1].min()) for s in tessellate_thing(thing))
    return Thing(name, name, name, primitives, 0.1, 0.0, 0, AT + np.array([0.0, TABLE_HEIGHT - low, 0.0]), axes=axes)


def _top(thing: Thing) -> F64:
    """Over the middle of a thing, or over the tube of a ring, at its highest [m]."""
    p = thing.primitives[0]
    ahead = p.params[0] * p.params[3] if p.kind == "supertoroid" else 0.0
    high = max(float(s.vertices[:, 1].max()) for s in tessellate_thing(thing))
    return thing.position + np.array([0.0, high, ahead])


def true_trials(takes: Takes, each: int) -> Iterator[Trial]:
    """Hands that close round a thing that lies in them, each closing on `each` sets of things."""
    rng = np.random.default_rng(takes.seed)
    for closing in _closings(takes.grabs, pinch=False):
        for k in range(each):
            for thing in things(rng):
                yield _on(f"{closing.name}, {thing.id} {k + 1}", thing, closing.fingers, rng, closing)
    for closing in _closings(takes.pinches, pinch=True):
        for k in range(4 * each):
            yield _pinched(f"{closing.name}, {k + 1}", closing, rng)


def false_trials(takes: Takes, each: int) -> Iterator[Trial]:
    """Hands that close beside things, pass them, rest on them, point at them, push them, wave over them, or are fists."""
    rng = np.random.default_rng(takes.seed + 1)
    rest, points = recording(takes.rest.path)[0], recording(takes.points.path)[0]
    waves = [recording(t.path, t.left)[0][: 3 * RATE_HZ] for t in takes.waves]
    for k in range(each):
        for number, closing in enumerate(_closings(takes.grabs, pinch=False)):
            for thing in things(rng):
                name = f"{closing.name}, {{}} {thing.id} {k + 1}"
                beside = _on(name.format("beside"), thing, closing.fingers, rng)
                yield _moved(beside, np.array([(1.0 if rng.random() < 0.5 else -1.0) * (0.10 + _half(thing, 0)), 0.02, 0.0]))
                yield _moved(_on(name.format("over"), thing, closing.fingers, rng), np.array([0.0, rng.uniform(0.11, 0.14), 0.0]))
                yield _past(_on(name.format("past"), thing, closing.fingers, rng), rng)
                fist = np.repeat(closing.fingers[closing.closes : closing.closes + 1], 60, axis=0)
                yield _on(name.format("fist on"), thing, fist, rng)
                if number == 0:
                    yield _on(name.format("resting on"), thing, rest[: 3 * RATE_HZ], rng)
                    yield _pointing(name.format("pointing at"), thing, points[:90], rng)
                    yield _pushing(name.format("pushing"), thing, rest[:60], rng)
                    for wave in waves:
                        yield _on(name.format("waving on"), thing, wave, rng)


def _on(name: str, thing: Thing, fingers: F64, rng: np.random.Generator, closing: _Closing | None = None) -> Trial:
    """The palm on the thing, up to 8 mm and 20 degrees off."""
    off = np.array([rng.uniform(-0.008, 0.008), rng.uniform(0.0, 0.008), rng.uniform(-0.008, 0.008)])
    heading, height = rng.uniform(-1.0, 1.0) * math.radians(20.0), float(rng.uniform(*SIZES))
    noisy = fingers + rng.normal(0.0, GLOVE, fingers.shape) + rng.normal(0.0, OFF, 20)
    way = rng.normal(0.0, TREMBLE, (len(fingers), 3))
    closes, opens = (closing.closes, closing.opens) if closing is not None else (None, None)
    return Trial(name, thing.id, noisy, closes, opens, _top(thing) + off, heading, height=height, way=way, own=(thing,))


def _pinched(name: str, closing: _Closing, rng: np.random.Generator) -> Trial:
    """Something small, where the thumb meets the finger that is nearest to it."""
    r = float(rng.uniform(0.006, 0.013))
    half = 0.03 if rng.random() < 0.4 else 0.0
    shape = ThingPrimitive("cone_sphere", (-half, 0.0, 0.0, half, 0.0, 0.0, r, r)) if half else ThingPrimitive("sphere", (r,))
    thing = standing_thing("small-x", shape)
    trial = _on(name, thing, closing.fingers, rng, closing)
    closed = trial.fingers[min(closing.closes + 10, len(trial.fingers) - 1)]
    off = rng.uniform(-0.004, 0.004, 3)
    return Trial(
        name,
        thing.id,
        trial.fingers,
        closing.closes,
        closing.opens,
        thing.position - _tips(closed, trial, ("thumb", _pinching(closed, trial))) + off,
        trial.heading,
        height=trial.height,
        way=trial.way,
        own=(thing,),
    )


def _pinching(fingers: F64, trial: Trial) -> str:
    """The finger whose tip is nearest to the thumb's."""
    thumb = _tips(fingers, trial, ("thumb",))
    return min(("index", "middle", "ring", "little"), key=lambda d: float(np.linalg.norm(_tips(fingers, trial, (d,)) - thumb)))


def _tips(fingers: F64, trial: Trial, digits: tuple[str, ...]) -> F64:
    """The middle between fingertips, from the palm [m]."""
    skeleton = build_of(trial.height, 1.0).skeleton
    pose = pose_joints(skeleton, hand_at(np.zeros(3), trial.heading, fingers, 1.0, trial.height))
    joints = [JOINT_INDEX[f"right_{d}_distal"] for d in digits]
    palm = pose.position[HAND_JOINT[1]] + pose.rotation[HAND_JOINT[1]] @ build_of(trial.height, 1.0).palm[1]
    return sum((pose.position[j] + pose.rotation[j] @ skeleton.tip[j] for j in joints), np.zeros(3)) / len(joints) - palm


def _half(thing: Thing, axis: int) -> float:
    return max(float(np.abs(s.vertices[:, axis]).max()) for s in tessellate_thing(thing))


def _moved(trial: Trial, by: F64) -> Trial:
    return Trial(
        trial.name,
        trial.thing,
        trial.fingers,
        None,
        None,
        trial.palm + by,
        trial.heading,
        trial.face,
        trial.height,
        trial.way,
        trial.own,
    )


def _past(trial: Trial, rng: np.random.Generator) -> Trial:
    """The open hand flies over the thing at a metre a second and closes half a second later, 25 cm beyond."""
    frames, over = 30, float(rng.uniform(0.025, 0.045))
    fingers = np.concatenate([np.repeat(trial.fingers[:1], frames, axis=0), trial.fingers])
    flown = np.concatenate([np.linspace(-0.25, 0.25, frames), np.full(len(trial.fingers), 0.25)])
    ahead = np.array([math.sin(trial.heading), 0.0, math.cos(trial.heading)])
    way = np.outer(flown, ahead) + np.array([0.0, over, 0.0]) + rng.normal(0.0, TREMBLE, (len(fingers), 3))
    return Trial(
        trial.name, trial.thing, fingers, None, None, trial.palm, trial.heading, height=trial.height, way=way, own=trial.own
    )


def _pointing(name: str, thing: Thing, fingers: F64, rng: np.random.Generator) -> Trial:
    """The tip of the index finger on the thing."""
    trial = _on(name, thing, fingers, rng)
    return _moved(trial, -_tips(trial.fingers[-1], trial, ("index",)))


def _pushing(name: str, thing: Thing, fingers: F64, rng: np.random.Generator) -> Trial:
    """Flat fingers push the thing 12 cm along the table."""
    trial = _on(name, thing, fingers, rng)
    ahead = np.array([math.sin(trial.heading), 0.0, math.cos(trial.heading)])
    tips = _tips(trial.fingers[0], trial, ("index", "middle", "ring"))
    start = thing.position - tips - (_half(thing, 2) + 0.03) * ahead
    start = np.array([start[0], TABLE_HEIGHT + max(0.03, 0.8 * _half(thing, 1)), start[2]])
    way = trial.way + np.outer(np.linspace(0.0, 0.15, len(trial.fingers)), ahead)
    return Trial(name, thing.id, trial.fingers, None, None, start, trial.heading, height=trial.height, way=way, own=(thing,))

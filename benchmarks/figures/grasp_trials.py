"""Recorded hands at things of the room: what they truly take hold of, and what the world says they do.

Truth comes from the recordings alone. A recorded hand (Leap Motion) truly grasps when the tracker's own grab strength, or
pinch strength for a pinch, rises through CLOSED while a thing lies in it; it does not when the strength stays low, when the
thing lies beyond its reach or on its back. In the recorded hand-over (KTH) a person holds the baton while the force sensor at
their end of it feels more than LEAST_FORCE. Nobody recorded fingers there: those of the Leap recording close and open when
the force comes and goes, on all four hands alike.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.leap import finger_angles, strengths, thumb_offsets
from vistel.arrays import F64
from vistel.conference.model import Conference
from vistel.figure.posture.hands import hand_rotation
from vistel.figure.posture.limits import FINGER_LIMITS
from vistel.figure.posture.posture import WRIST, Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import rotvec_from_matrix
from vistel.space.inputs import MotionInput, ParticipantBody, PropInput, StepInputs
from vistel.space.people import HAND_JOINT, build_of
from vistel.space.room import BATON, TABLE_HEIGHT, Extra, meeting_room
from vistel.space.things.things import Thing
from vistel.space.view import WorldView
from vistel.space.world import APPEARING_STEPS, World
from vistel_sim.motion import open_motion

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data"
RATE_HZ, STEP_NS = 60, 16_666_667
CLOSED, OPENED = 0.8, 0.2
"""Strengths at which a recorded hand is closed and open."""
LATE_S = 0.25
"""The world finds a grasp no later than this after the truth."""
LEAST_FORCE = 2.0
"""At an end of the recorded baton, from which on somebody holds it [N]; the sensors' noise stays below 1.6 N."""
UNSURE_S = 0.15
"""Round each change of the force nobody knows to whom the baton belongs."""
BUILD = build_of(1.75, 1.0)
_TIP_THUMB, _TIP_INDEX = JOINT_INDEX["right_thumb_distal"], JOINT_INDEX["right_index_distal"]
THINGS = ("baton", "ball", "box", "can", "ring", "cone", "tile")
SMALL = (("marble", "ball", 0.010), ("pill", "lump", 0.008), ("pen", "bar", 0.005))
"""For pinches: id, shape, radius [m]."""
HELD_ON = 50
"""Frames for which a hand stays as it was at the end of a recording in which it does not open."""
EACH = 4
"""Placements of each thing under each closing."""


@dataclass(frozen=True)
class Trial:
    """One recorded hand at one thing: fingers (n, 20) [rad] at RATE_HZ; closes, opens: frames in which it truly does
    (None: never); palm: where the palm comes to (3,) [m]; heading: of the fingers [rad]; face: +1 palm down, -1 up.

    height: of the person [m]; way: (n, 3) by which the palm is off its place in each frame [m], zeros if empty; own: things
    beside those of the room, where they stand.
    """

    name: str
    thing: str
    fingers: F64
    closes: int | None
    opens: int | None
    palm: F64
    heading: float
    face: float = 1.0
    height: float = 1.75
    way: F64 = field(default_factory=lambda: np.zeros((0, 3)))
    own: tuple[Thing, ...] = ()


@dataclass(frozen=True)
class Ran:
    """What the world made of a trial: the frame in which it saw the hand take hold (None: never); whether the thing went
    up with the hand; the frame it saw it let go; views: of the frames held."""

    trial: Trial
    took: int | None
    lifted: bool
    left: int | None
    held: WorldView | None
    posture: Posture | None


def recorded(name: str) -> tuple[F64, F64, F64]:
    """Fingers (n, 20), grab and pinch strength (n,) at RATE_HZ, of the right hand in one of the recordings."""
    return recording(DATA / "hand" / "leap" / f"{name}.json.lz")


@lru_cache(maxsize=24)
def recording(path: Path, left: bool = False) -> tuple[F64, F64, F64]:
    """Fingers (n, 20) as of a right hand, grab and pinch strength (n,) at RATE_HZ."""
    fingers = finger_angles(path, RATE_HZ, left)
    off, length = thumb_offsets(path, RATE_HZ, left)
    fingers[:, :4] = _thumbs(fingers, off, length)
    grab, pinch = strengths(path, RATE_HZ, left)
    return fingers, grab, pinch


def _thumbs(fingers: F64, off: F64, length: F64) -> F64:
    """(n, 4) thumb angles that bring its tip to where it was recorded from the index finger's tip, in proportion to that
    finger's length; damped least squares, each frame from the one before."""
    skeleton = BUILD.skeleton
    own = sum(float(np.linalg.norm(skeleton.tip[JOINT_INDEX[f"right_index_{b}"]])) for b in ("proximal", "intermediate", "distal"))
    out, angles = np.empty((len(fingers), 4)), np.array([0.6, 0.44, 0.17, 0.17])
    rest = angles.copy()
    low, high = FINGER_LIMITS[:4].T
    for k, row in enumerate(fingers):
        wanted = np.array([-off[k, 0], -off[k, 2], off[k, 1]]) * own / length[k]

        def miss(a: F64, row: F64 = row, wanted: F64 = wanted) -> F64:
            return np.concatenate([_tips_apart(np.concatenate([a, row[4:]])) - wanted, 0.004 * (a - rest)])

        for _ in range(40 if k == 0 else 8):
            here = miss(angles)
            jacobian = np.stack([(miss(angles + d) - here) / 1e-4 for d in 1e-4 * np.eye(4)], 1)
            step = np.linalg.solve(jacobian.T @ jacobian + 1e-6 * np.eye(4), -jacobian.T @ here)
            angles = np.asarray(np.clip(angles + np.clip(step, -0.2, 0.2), low, high), np.float64)
        out[k] = angles
    return out


def _tips_apart(fingers: F64) -> F64:
    """(3,) from the right index finger's tip to the thumb's in the hand joint's frame [m]."""
    hands = np.zeros((2, 20))
    hands[1] = fingers
    pose, hand = pose_joints(BUILD.skeleton, Posture(hands=hands)), HAND_JOINT[1]
    tips = [pose.position[j] + pose.rotation[j] @ BUILD.skeleton.tip[j] for j in (_TIP_THUMB, _TIP_INDEX)]
    return pose.rotation[hand].T @ (tips[0] - tips[1])


def closings(strength: F64) -> Iterator[tuple[int, int, int, int | None]]:
    """(first frame, frame it is closed, last frame, frame it is open again) of every closing of a recording."""
    k = 0
    while k < len(strength):
        ahead = np.flatnonzero(strength[k:] >= CLOSED)
        if not len(ahead):
            return
        closed = k + int(ahead[0])
        before = np.flatnonzero(strength[:closed] <= 0.05)
        first = max(k, int(before[-1]) - 6) if len(before) else k  # and not the closing before
        after = np.flatnonzero(strength[closed:] <= OPENED)
        opened = closed + int(after[0]) if len(after) else None
        # The end of a recording tears the hand open at once; that is no opening.
        falls = -np.diff(strength[closed : opened + 1]) if opened is not None else np.zeros(1)
        torn = float(falls.max()) > 0.3
        last = len(strength)
        if opened is not None:
            last = closed + int(np.argmax(falls > 0.3)) if torn else min(len(strength), opened + 20)
        yield first, closed, last, None if torn else opened
        k = (opened or len(strength)) + 1


def true_trials(each: int = EACH) -> Iterator[Trial]:
    """Hands that close round a thing that lies in them."""
    rng = np.random.default_rng(66)
    fingers, grab, _ = recorded("grab")
    for number, (first, closed, last, opened) in enumerate(closings(grab)):
        for thing in THINGS:
            for k in range(each):
                palm, heading = _over(thing, rng)
                yield Trial(
                    f"grab {number + 1}, {thing} {k + 1}",
                    thing,
                    fingers[first:last],
                    closed - first,
                    None if opened is None else opened - first,
                    palm,
                    heading,
                )
    fingers, _, pinch = recorded("pinch")
    for first, closed, last, opened in closings(pinch):
        for thing, _, _ in SMALL:
            for k in range(each):
                palm, heading = _pinching(thing, fingers[min(last - 1, closed + 10)], rng)
                yield Trial(
                    f"pinch, {thing} {k + 1}",
                    thing,
                    fingers[first:last],
                    closed - first,
                    None if opened is None else opened - first,
                    palm,
                    heading,
                )


def false_trials(each: int = EACH) -> Iterator[Trial]:
    """Hands that close round nothing, or do not close."""
    rng = np.random.default_rng(67)
    for name in ("wave", "HandSplay-110fps"):
        fingers = recorded(name)[0]
        for thing in THINGS:
            for k in range(each // 2):
                palm, heading = _over(thing, rng)
                yield Trial(f"{name}, on {thing} {k + 1}", thing, fingers, None, None, palm, heading)
    fingers, grab, _ = recorded("grab")
    for number, (first, _, last, _) in enumerate(closings(grab)):
        for thing in THINGS:
            for k in range(each // 2):
                palm, heading = _over(thing, rng)
                way = rng.uniform(0.0, 2.0 * math.pi)
                aside = palm + np.array([0.22 * math.sin(way), 0.02, 0.22 * math.cos(way)])
                yield Trial(f"grab {number + 1}, beside {thing} {k + 1}", thing, fingers[first:last], None, None, aside, heading)
            palm, heading = _over(thing, rng)
            # Palm up: the thing is under the back of the hand.
            over = palm + np.array([0.0, 0.03, 0.0])
            yield Trial(f"grab {number + 1}, back on {thing}", thing, fingers[first:last], None, None, over, heading, -1.0)


def run(trial: Trial) -> Ran:
    """Play a trial: the hand comes from above, does what was recorded, and goes up once it is closed."""
    world = _begun(trial)
    k = world.step_number
    took = left = None
    held: WorldView | None = None
    posture: Posture | None = None
    start = 0.0
    rise = 0.0
    lifted = False
    lead = 12
    length = len(trial.fingers) + (HELD_ON if trial.opens is None and trial.closes is not None else 0)
    for frame in range(-lead, length):
        k += 1
        above = 0.12 * max(0.0, -frame / lead)
        if trial.closes is not None and frame > trial.closes + LATE_S * RATE_HZ and left is None:
            rise += 0.006
        n = min(max(0, frame), len(trial.fingers) - 1)
        at = trial.palm + np.array([0.0, above + min(0.2, rise), 0.0]) + (trial.way[n] if len(trial.way) else 0.0)
        here = hand_at(at, trial.heading, trial.fingers[n], trial.face, trial.height)
        view = world.step(StepInputs(k, k * STEP_NS, (), (MotionInput("p", here, k, k * STEP_NS),)))
        thing = next(s for s in view.states if s.id == trial.thing)
        has = any(g.thing == trial.thing for g in view.grasps)
        if has and took is None:
            took, start = frame, float(thing.position[1])
        if took is not None and not has and left is None:
            left = frame
        if has and took is not None and frame == took + 12:
            held, posture = view, here
        lifted = lifted or (has and rise > 0.08 and float(thing.position[1]) - start > 0.06)
    return Ran(trial, took, lifted, left, held, posture)


def found(ran: Ran) -> bool:
    """The true grasp was found in time and carried the thing."""
    t = ran.trial
    assert t.closes is not None
    return ran.took is not None and ran.took <= t.closes + LATE_S * RATE_HZ and ran.lifted


def _begun(trial: Trial) -> World:
    """A room with the thing, and a person whose hand is high above it and has been for a while."""
    extras = [Extra(n, n, shape, r, 0.02, 1.0, 0, -0.2, 0.2) for n, shape, r in SMALL if n == trial.thing]
    room = meeting_room(3, extras)
    world = World(replace(room, things=(*room.things, *trial.own)) if trial.own else room)
    high = trial.palm + np.array([0.0, 0.3, 0.0]) + (trial.way[0] if len(trial.way) else 0.0)
    before = trial.fingers[0] if trial.own else recorded("wave")[0][0]
    far = hand_at(high, trial.heading, before, trial.face, trial.height)
    for k in range(1, APPEARING_STEPS + 2):
        people = (ParticipantBody("p", trial.height),) if k == 1 else ()
        world.step(StepInputs(k, k * STEP_NS, people, (MotionInput("p", far, k, k * STEP_NS),)))
    return world


def hand_at(palm: F64, heading: float, fingers: F64, face: float, height: float = 1.75) -> Posture:
    """Somebody whose right palm is at `palm` [m, room], facing down (face +1) or up; the feet stand where it comes right."""
    build = build_of(height, 1.0)
    posture = standing()
    dofs = posture.dofs.copy()
    pose = pose_joints(build.skeleton, Posture(dofs, stance=Stance(np.zeros(3), heading)))
    ahead = np.array([math.sin(heading), 0.0, math.cos(heading)])
    wanted = hand_rotation(-1.0, ahead, np.array([0.0, -face, 0.0]))
    forearm = pose.rotation[JOINT_INDEX["right_lower_arm"]]
    dofs[WRIST["right"]] = rotvec_from_matrix(np.ascontiguousarray(forearm.T @ wanted))
    hands = np.zeros((2, 20))
    hands[1] = fingers
    pose = pose_joints(build.skeleton, Posture(dofs, hands, Stance(np.zeros(3), heading)))
    hand = HAND_JOINT[1]
    reached = pose.position[hand] + pose.rotation[hand] @ build.palm[1]
    return Posture(dofs, hands, Stance(palm - reached, heading))


def _over(thing: str, rng: np.random.Generator) -> tuple[F64, float]:
    """Where a palm lies on a thing as it stands in the room, and how its fingers point: up to 8 mm and 20 degrees off."""
    t = meeting_room(3).thing(thing)
    top = {"baton": 0.012, "ball": 0.038, "box": 0.030, "can": 0.055, "ring": 0.011, "cone": 0.030, "tile": 0.009}[thing]
    off = np.array([rng.uniform(-0.008, 0.008), rng.uniform(0.0, 0.008), rng.uniform(-0.008, 0.008)])
    middle = t.position + np.array([0.0, top, 0.046 if thing == "ring" else 0.0])
    turn = {"box": math.radians(20.0)}.get(thing, 0.0)
    return middle + off, turn + rng.uniform(-1.0, 1.0) * math.radians(20.0)


def _pinching(thing: str, closed: F64, rng: np.random.Generator) -> tuple[F64, float]:
    """Where the palm is when thumb and index finger, as they are when closed, meet at the thing."""
    radius = next(r for n, _, r in SMALL if n == thing)
    posture = hand_at(np.zeros(3), 0.0, closed, 1.0)
    pose = pose_joints(BUILD.skeleton, posture)
    tips = [pose.position[j] + pose.rotation[j] @ BUILD.skeleton.tip[j] for j in (_TIP_THUMB, _TIP_INDEX)]
    middle = 0.5 * (tips[0] + tips[1])
    off = np.array([rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)]) * 0.004
    return np.array([-0.2, TABLE_HEIGHT + radius, 0.2]) - middle + off, 0.0


@dataclass(frozen=True)
class HandOverResult:
    """Frames (n, 4) of the four hands (giver's left and right, taker's): who truly holds, who the world says does; sure
    (n, 4): where the truth is known."""

    truth: NDArray[np.bool_]
    said: NDArray[np.bool_]
    sure: NDArray[np.bool_]


def hand_over() -> HandOverResult:
    """The recorded hand-over through the world, the baton on its own tracker."""
    folder = DATA / "body" / "kth_handover" / "take_new"
    people = [{"name": name, "motion": str(folder)} for name in ("giver", "taker")]
    conference = Conference.model_validate({"sites": [{"name": "here", "participants": people, "props": [{"thing": BATON}]}]})
    source = open_motion(conference)
    force = np.stack([_force(folder, role) for role in ("giver", "taker")], 1)
    grips = [_fingers_by(force[:, c] > LEAST_FORCE) for c in range(2)]
    n = len(force)
    world = World(meeting_room(3))
    truth, said, sure = (np.zeros((n, 4), np.bool_) for _ in range(3))
    lead = APPEARING_STEPS + 5
    for k in range(-lead, n):
        step, frame = k + lead + 1, max(0, k)
        t_ns = step * STEP_NS
        motions = []
        for c, name in enumerate(("giver", "taker")):
            p = source.posture(name, frame / RATE_HZ)
            motions.append(MotionInput(name, replace(p, hands=np.stack([grips[c][frame]] * 2)), step, t_ns))
        prop = PropInput(BATON, *source.things(frame / RATE_HZ)[BATON], t_ns)
        new = tuple(ParticipantBody(name) for name in ("giver", "taker")) if step == 1 else ()
        view = world.step(StepInputs(step, t_ns, new, tuple(motions), props=(prop,)))
        if k >= 0:
            for g in view.grasps:
                said[k, 2 * ("giver", "taker").index(g.participant) + int(g.right)] |= g.thing == BATON
    for c in range(2):
        holds = force[:, c] > LEAST_FORCE
        truth[:, 2 * c + 1] = holds
        changes = np.flatnonzero(np.diff(holds)) + 1
        far = np.full(n, True)
        for change in changes:
            far[max(0, change - int(UNSURE_S * RATE_HZ)) : change + int(UNSURE_S * RATE_HZ)] = False
        sure[:, 2 * c] = sure[:, 2 * c + 1] = far
    return HandOverResult(truth, said, sure)


def _force(folder: Path, role: str) -> F64:
    """(n,) newtons at this end of the baton at RATE_HZ; blips under 0.1 s are gone."""
    rows = np.loadtxt(folder / f"Wrench_{role}_saved.csv", delimiter=",", skiprows=1)
    size = np.sqrt((rows[:, :3] ** 2).sum(axis=1))
    smooth = np.array([np.median(size[max(0, k - 6) : k + 7]) for k in range(len(size))])
    return smooth[::2]


def _fingers_by(holds: NDArray[np.bool_]) -> F64:
    """(n, 20) the recorded hand (grab), closed when the force comes and opening when it goes."""
    fingers, grab, _ = recorded("grab")
    first, closed, last, opened = next(closings(grab))
    assert opened is not None
    hold = closed + 8
    rows = np.zeros(len(holds), int)
    row = float(hold if holds[0] else first)
    for k in range(len(holds)):
        soon = bool(holds[k : k + closed - first].any()) and not holds[k]
        if holds[k]:
            row = min(float(hold), max(row, float(closed)) + 1.0)
        elif soon and row < closed:
            row += 1.0
        elif row >= closed:
            row = max(row, float(opened - 8)) + 1.0
            row = float(first) if row >= last - 1 else row
        rows[k] = int(row)
    return fingers[rows]

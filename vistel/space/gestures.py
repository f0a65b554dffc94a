"""What people say with their hands: a hand held above the head is a raised hand, a thumb held up is a reaction.

Both are read from postures here and nowhere else. What is asked of a posture was chosen on recordings of people who do other things
(`python -m benchmarks.figures.gestures`), so that nobody raises a hand who scratches their head.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from vistel.arrays import F64
from vistel.figure.skeleton import JOINT_INDEX, Skeleton
from vistel.space.arguments import Reaction
from vistel.space.people import SIDES, Posed, flexion_of
from vistel.space.signals import RaisedHand, ShownReaction
from vistel.space.state import Gesture, State

EVERY = 6
"""Steps from one look at people to the next: ten times a second."""
UP = "up"
"""One hand is above the head."""
DOWN = "down"
"""No hand is; looked for in those whose figure has raised one."""
THUMB = "thumb"
"""A fist with its thumb up."""
STEPS = {UP: 60, DOWN: 30, THUMB: 30}
"""A gesture counts when it has been held for so many steps: a second, half a second, half a second."""
CLOSED = 2.6
"""Flexion of each of the four fingers of a fist, its three joints together, at least [rad]."""
THUMB_UP = 0.8, 0.6
"""Height of a thumb's direction, of 1, at least: within 37 degrees of upright to begin with, and within 53 while it goes on, for
landmarks of a camera tremble."""
LOW = 0.4
"""Share of the way from the hips to the head above which a hand is no longer at rest in a lap or on a table."""
STRAIGHT = 0.5
"""Both flexions of a straight thumb together, at most [rad]."""

_HEAD = JOINT_INDEX["head"]
_HIPS = JOINT_INDEX["hips"]
_WRIST = [JOINT_INDEX[f"{side}_hand"] for side in SIDES]
_KNUCKLE = [JOINT_INDEX[f"{side}_middle_proximal"] for side in SIDES]
_ELBOW = [JOINT_INDEX[f"{side}_lower_arm"] for side in SIDES]
_THUMBS = [[JOINT_INDEX[f"{side}_thumb_{part}"] for part in ("proximal", "distal")] for side in SIDES]


def hands_above(skeleton: Skeleton, position: F64) -> tuple[bool, bool]:
    """Whether the left and the right hand are above the head: its knuckles above the crown, its wrist above its elbow. position:
    (J, 3) joints in the room [m]."""
    crown = float(position[_HEAD, 1] + skeleton.height - skeleton.rest[_HEAD, 1])
    left, right = (bool(position[_KNUCKLE[n], 1] > crown and position[_WRIST[n], 1] > position[_ELBOW[n], 1]) for n in (0, 1))
    return left, right


def fists_with_thumbs(hands: F64) -> tuple[bool, bool]:
    """Whether the left and the right hand are fists with a straight thumb. hands: (2, 20), as of `Posture.hands`."""
    left, right = np.all(flexion_of(hands) >= CLOSED, axis=1) & (hands[:, 2] + hands[:, 3] <= STRAIGHT)
    return bool(left), bool(right)


def thumbs_up(hands: F64, position: F64, going_on: bool = False) -> tuple[bool, bool]:
    """Whether the left and the right hand are fists whose straight thumbs point up, higher than the lap.
    hands: as above; position: (J, 3) joints in the room [m]; going_on: whether one was at the last look."""
    fists = fists_with_thumbs(hands)
    if not any(fists):
        return fists
    low = float(position[_HIPS, 1] + LOW * (position[_HEAD, 1] - position[_HIPS, 1]))
    least = THUMB_UP[going_on]
    left, right = (fists[n] and bool(position[_WRIST[n], 1] > low) and _points_up(position[_THUMBS[n]], least) for n in (0, 1))
    return left, right


def _points_up(thumb: F64, least: float) -> bool:
    """thumb: (2, 3) its last two joints; least: as of THUMB_UP."""
    way = thumb[1] - thumb[0]
    return bool(way[1] >= least * np.linalg.norm(way))


def gestured(state: State, posed: Mapping[str, Posed]) -> State:
    """The state after what people say with their hands in a step, and without the signals that have ended. posed: everybody at this
    step."""
    signals = state.signals.at(state.step, {f.name for f in state.figures})
    if state.step % EVERY:
        return state if signals is state.signals else state.but(signals=signals)
    before = {(g.participant, g.kind): g for g in state.gestures}
    by_gesture = {h.participant for h in signals.raised if h.by_gesture}
    holds = {(g.participant, g.right) for g in state.grasps}
    gestures: list[Gesture] = []
    for name in sorted(posed):
        for kind in _kinds(posed[name], name in by_gesture, holds, (name, THUMB) in before):
            now = before.get((name, kind)) or Gesture(name, kind, state.step)
            gestures.append(now)
            held = state.step - now.since
            if kind == UP and held >= STEPS[UP] and signals.hand_of(name) is None:
                signals = signals.with_hand(RaisedHand(name, state.t_ns, True))
            elif kind == DOWN and held >= STEPS[DOWN]:
                signals = signals.without_hand(name)
            elif kind == THUMB and held == STEPS[THUMB] and signals.may_react(name, state.step):
                signals = signals.with_reaction(ShownReaction(name, Reaction.THUMB_UP, state.step))
    if not gestures and not state.gestures and signals is state.signals:
        return state
    return state.but(signals=signals, gestures=tuple(gestures))


def _kinds(posed: Posed, raised: bool, holds: set[tuple[str, bool]], thumb: bool) -> Iterable[str]:
    """What a person does now; thumb: whether they held one up at the last look. Two hands above the head are no signal: who
    stretches does so. A hand with a thing in it shows no thumb."""
    above = hands_above(posed.build.skeleton, posed.joints.position)
    if above[0] != above[1]:
        yield UP
    if raised and not any(above):
        yield DOWN
    if posed.figure.posture is None:
        return
    thumbs = thumbs_up(posed.figure.posture.hands, posed.joints.position, thumb)
    if any(up and (posed.name, right) not in holds for right, up in zip((False, True), thumbs, strict=True)):
        yield THUMB


def begun_anew(gestures: Iterable[Gesture], participant: str, step: int) -> tuple[Gesture, ...]:
    """What somebody holds counts from `step` on."""
    now = step + -step % EVERY
    return tuple(Gesture(g.participant, g.kind, now) if g.participant == participant else g for g in gestures)

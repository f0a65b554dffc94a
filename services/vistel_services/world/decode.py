"""From messages to what the world takes in."""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from vistel.figure.people.recipe import parse_spec
from vistel.figure.posture import Posture, Stance
from vistel.figure.proportions import Proportions
from vistel.space.inputs import CommandInput, Delete, MotionInput, Move, Person, PropInput, Release, Reset
from vistel.v1.command_pb2 import Command
from vistel.v1.geometry_pb2 import Pose
from vistel.v1.motion_pb2 import Participant, Prop
from vistel.v1.world_pb2 import WorldInputs
from vistel.wire.motion import MotionSample
from vistel.wire.proportions import from_message

F64 = NDArray[np.float64]

log = logging.getLogger("vistel.world")


def motion_input(participant: str, sample: MotionSample) -> MotionInput:
    """A decoded motion as the world takes it."""
    gaze = np.zeros(2) if sample.gaze is None else sample.gaze
    posture = Posture(sample.body, sample.hands, Stance(sample.stance[:3], float(sample.stance[3])), gaze)
    return MotionInput(participant, posture, sample.seq, sample.t_ns)


def person(participant: str, message: Participant) -> Person:
    """Height and girth of somebody, or the proportions of their own avatar; what cannot be read counts as average."""
    build = 1.0
    if message.HasField("proportions"):
        try:
            own = Proportions.from_arrays(**from_message(message.proportions))
            return Person(participant, own.skeleton.height, build, own)
        except ValueError as e:
            log.warning("proportions refused participant=%s reason=%r contacts=average", participant, str(e))
    if message.avatar.startswith("builtin"):
        try:
            build = parse_spec(message.avatar, participant).build
        except ValueError as e:
            log.warning("avatar not understood participant=%s reason=%s", participant, e)
    return Person(participant, float(message.height_m) or 1.75, build)


def command_input(participant: str, message: Command) -> CommandInput:
    """A command of `participant`, whose key it came on; one in another's name has no action and is refused."""
    kind = message.WhichOneof("action") if message.participant in ("", participant) else None
    if kind == "move":
        action = Move(message.move.thing, *pose(message.move.pose))
    elif kind == "release":
        action = Release(message.release.thing)
    elif kind == "delete":
        action = Delete(message.delete.thing)
    else:
        action = Reset() if kind == "reset" else None
    return CommandInput(message.id, participant, action)


def pose(message: Pose) -> tuple[F64, F64]:
    """position (3,), rotation (4,) quaternion; all zero means identity."""
    p, q = message.position, message.rotation
    rotation = np.array([q.x, q.y, q.z, q.w], np.float64)
    return np.array([p.x, p.y, p.z], np.float64), rotation if rotation.any() else np.array([0.0, 0.0, 0.0, 1.0])


def prop_input(message: Prop) -> PropInput:
    """Where a tracked thing is, as the world takes it."""
    v, w = message.velocity, message.spin
    speeds = np.array([v.x, v.y, v.z], np.float64), np.array([w.x, w.y, w.z], np.float64)
    return PropInput(message.thing, *pose(message.pose), message.header.t_ns, *speeds)


def people_of(inputs: WorldInputs) -> tuple[Person, ...]:
    """Who came in a recorded step."""
    return tuple(Person(p.participant, p.height_m, p.build, _own(p)) for p in inputs.people)


def _own(p: WorldInputs.Person) -> Proportions | None:
    return Proportions.from_arrays(**from_message(p.proportions)) if p.HasField("proportions") else None

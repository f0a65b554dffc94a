"""From messages to what the world takes in."""

import logging

import numpy as np

from vistel.figure.avatar.proportions import Proportions
from vistel.figure.people.recipe import parse_spec
from vistel.messages.commands import action_of, pose
from vistel.messages.postures import posture_of
from vistel.space.inputs import CommandInput, MotionInput, ParticipantBody, PropInput
from vistel.v1.command_pb2 import Command
from vistel.v1.motion_pb2 import Participant, Prop
from vistel.v1.world_pb2 import WorldInputs
from vistel.wire.motion import MotionSample
from vistel.wire.proportions import from_message

log = logging.getLogger("vistel.world")


def motion_input(participant: str, sample: MotionSample) -> MotionInput:
    """A decoded motion as the world takes it."""
    return MotionInput(participant, posture_of(sample), sample.seq, sample.t_ns)


def person(participant: str, message: Participant) -> ParticipantBody:
    """Height and girth of somebody, or the proportions of their own avatar; what cannot be read counts as average."""
    build = 1.0
    if message.HasField("proportions"):
        try:
            own = Proportions.from_arrays(**from_message(message.proportions))
            return ParticipantBody(participant, own.skeleton.height, build, own)
        except ValueError as e:
            log.warning("proportions refused participant=%s reason=%r contacts=average", participant, str(e))
    if message.avatar.startswith("builtin"):
        try:
            build = parse_spec(message.avatar, participant).build
        except ValueError as e:
            log.warning("avatar not understood participant=%s reason=%s", participant, e)
    return ParticipantBody(participant, float(message.height_m) or 1.75, build)


def command_input(participant: str, message: Command) -> CommandInput:
    """A command of `participant`, whose key it came on; one in another's name has no action and is refused."""
    own = message.participant in ("", participant)
    return CommandInput(message.id, participant, action_of(message) if own else None)


def prop_input(message: Prop) -> PropInput:
    """Where a tracked thing is, or one that a mouse leads, as the world takes it."""
    v, w = message.velocity, message.spin
    speeds = np.array([v.x, v.y, v.z], np.float64), np.array([w.x, w.y, w.z], np.float64)
    return PropInput(message.thing, *pose(message.pose), message.header.t_ns, *speeds, message.led_by, message.let_go)


def people_of(inputs: WorldInputs) -> tuple[ParticipantBody, ...]:
    """Who came in a recorded step."""
    return tuple(ParticipantBody(p.participant, p.height_m, p.build, _own(p)) for p in inputs.people)


def _own(p: WorldInputs.Person) -> Proportions | None:
    return Proportions.from_arrays(**from_message(p.proportions)) if p.HasField("proportions") else None

"""From messages to inputs of the world."""

import logging

import numpy as np

from vistel.figure.avatar.proportions import Proportions
from vistel.messages.commands_read import action_of, pose
from vistel.messages.postures import posture_of
from vistel.space.inputs import CommandInput, MotionInput, ParticipantBody, PropInput
from vistel.v1.command_pb2 import Command
from vistel.v1.motion_pb2 import Participant, Prop
from vistel.v1.world_pb2 import WorldInputs
from vistel.wire.motion import MotionSample
from vistel.wire.motion.proportions import from_message

log = logging.getLogger("vistel.world")


def motion_input(participant: str, sample: MotionSample) -> MotionInput:
    """A decoded motion as an input of the world."""
    return MotionInput(participant, posture_of(sample), sample.seq, sample.t_ns)


def person(participant: str, message: Participant) -> ParticipantBody:
    """Height of a participant, or the proportions of their own avatar. Proportions that cannot be read count as average."""
    if message.HasField("proportions"):
        try:
            own = Proportions.from_arrays(**from_message(message.proportions))
            return ParticipantBody(participant, own.skeleton.height, proportions=own)
        except ValueError as e:
            log.warning("proportions refused participant=%s reason=%r contacts=average", participant, str(e))
    return ParticipantBody(participant, float(message.height_m) or 1.75)


def command_input(participant: str, message: Command) -> CommandInput:
    """A command received on the key of `participant`. One in the name of somebody else has no action and is refused."""
    own = message.participant in ("", participant)
    return CommandInput(message.id, participant, action_of(message) if own else None)


def prop_input(message: Prop) -> PropInput:
    """The pose of a tracked thing, or of one that a mouse moves, as an input of the world."""
    v, w = message.velocity, message.spin
    speeds = np.array([v.x, v.y, v.z], np.float64), np.array([w.x, w.y, w.z], np.float64)
    return PropInput(message.thing, *pose(message.pose), message.header.t_ns, *speeds, message.led_by, message.let_go)


def people_of(inputs: WorldInputs) -> tuple[ParticipantBody, ...]:
    """Who joined in a recorded step."""
    return tuple(ParticipantBody(p.participant, p.height_m, p.build, _own(p)) for p in inputs.people)


def _own(p: WorldInputs.Person) -> Proportions | None:
    return Proportions.from_arrays(**from_message(p.proportions)) if p.HasField("proportions") else None

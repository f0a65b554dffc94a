"""From states of the world to messages."""

from collections.abc import Sequence

import numpy as np

from vistel.arrays import F64
from vistel.messages.boards import stroke_message
from vistel.space.arguments import Reaction
from vistel.space.hands.claims import ClaimChange, ClaimEvent
from vistel.space.inputs import ParticipantBody
from vistel.space.joints.buttons import ButtonEvent
from vistel.space.memory.bonds import Bond, Torn
from vistel.space.memory.dents import DentRecord
from vistel.space.signals import Signals
from vistel.space.things.things import Thing, ThingPrimitive
from vistel.space.view import GraspView, HandForce, Outcome, ThingView, WorldView
from vistel.v1 import command_pb2, geometry_pb2, world_pb2
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.motion.proportions import to_message

STATE_STEPS = 60
"""Steps between two recorded private states: a second."""

NO_SIGNALS = Signals()
"""Nobody raises a hand or reacts."""

_REACTIONS = {each: command_pb2.Reaction.Value(f"REACTION_{each.name}") for each in Reaction}
_FELT = world_pb2.HandForce
_DIGITS = (_FELT.DIGIT_THUMB, _FELT.DIGIT_INDEX, _FELT.DIGIT_MIDDLE, _FELT.DIGIT_RING, _FELT.DIGIT_LITTLE, _FELT.DIGIT_PALM)
_OWNED = world_pb2.Ownership
_CLAIMS = {
    ClaimChange.GRANTED: _OWNED.EVENT_GRANTED,
    ClaimChange.REJECTED: _OWNED.EVENT_REJECTED,
    ClaimChange.TAKEN: _OWNED.EVENT_TAKEN,
    ClaimChange.EXPIRED: _OWNED.EVENT_EXPIRED,
    ClaimChange.RELEASED: _OWNED.EVENT_RELEASED,
}


def carries_state(step: int, begins: bool) -> bool:
    """Whether the inputs of this step carry the state before it."""
    return begins or step % STATE_STEPS == 0


def world_state(view: WorldView, things: Sequence[world_pb2.Thing] | None = None) -> world_pb2.WorldState:
    """The whole room at a step, in readable fields. things: their messages, if they have been made already."""
    out = world_pb2.WorldState(step=view.step, key=True, participants=view.participants, hash=view.hash or None)
    out.header.t_ns = view.t_ns
    out.things.extend(things if things is not None else [thing_message(t) for t in view.things])
    out.states.extend(_thing_state(s) for s in view.states)
    for c in view.contacts:
        out.contacts.add(
            body_a=c.body_a,
            body_b=c.body_b,
            primitive_a=c.primitive_a,
            primitive_b=c.primitive_b,
            point=_vec3(c.point),
            normal=_vec3(c.normal),
            depth=c.depth,
            force=c.force,
        )
    for g in view.ghosts:
        out.ghosts.add(
            target=g.target,
            source=g.source,
            kind=world_pb2.Ghost.KIND_COLLISION,
            target_primitives=g.target_primitives,
            source_primitives=g.source_primitives,
            compliance_target=g.compliance_target,
            compliance_source=g.compliance_source,
            depth=g.depth,
        )
    out.dents.extend(dent_message(d) for d in view.dents)
    out.bonds.extend(bond_message(b) for b in view.bonds)
    out.strokes.extend(stroke_message(s) for s in view.strokes)
    out.grasps.extend(grasp_message(h) for h in view.grasps)
    if view.selected:
        out.selections.CopyFrom(selections(view))
    if view.signals != NO_SIGNALS:
        out.signals.CopyFrom(signals(view))
    return out


def signals(view: WorldView) -> world_pb2.Signals:
    """Raised hands and reactions."""
    out = world_pb2.Signals()
    for hand in view.signals.raised:
        out.raised.add(participant=hand.participant, since_ns=hand.since_ns, by_gesture=hand.by_gesture)
    for shown in view.signals.reactions:
        out.reactions.add(participant=shown.participant, reaction=_REACTIONS[shown.reaction])
    return out


def selections(view: WorldView) -> world_pb2.Selections:
    """Which things people have selected."""
    out = world_pb2.Selections()
    for who, things in view.selected:
        out.of.add(participant=who, things=things)
    return out


def hand_force(h: HandForce, step: int, t_ns: int) -> world_pb2.HandForce:
    """What a hand feels at a step."""
    out = world_pb2.HandForce(
        step=step,
        participant=h.participant,
        right=h.right,
        force=_vec3(h.force),
        torque=_vec3(h.torque),
        pull=_vec3(h.pull) if h.pull.any() else None,
    )
    out.header.t_ns = t_ns
    for t in h.touches:
        out.touches.add(
            digit=_DIGITS[t.digit],
            body=t.body,
            point=_vec3(t.point),
            normal=_vec3(t.normal),
            force=_vec3(t.force),
            normal_force=t.normal_force,
            area=t.area,
            mean_pressure=t.mean_pressure,
            peak_pressure=t.peak_pressure,
            depth=t.depth,
        )
    return out


def command_result(outcome: Outcome, t_ns: int) -> CommandResult:
    """The answer to a command."""
    done = CommandResult.OUTCOME_DONE if outcome.done else CommandResult.OUTCOME_REFUSED
    out = CommandResult(id=outcome.id, outcome=done, reason=outcome.reason, step=outcome.step, things=outcome.things)
    out.header.t_ns = t_ns
    return out


def ownership(event: ClaimEvent, step: int, t_ns: int) -> world_pb2.Ownership:
    """What has become of a claim in a step."""
    out = world_pb2.Ownership(
        step=step,
        event=_CLAIMS[event.change],
        participant=event.participant,
        thing=event.thing,
        owner=event.owner,
        until_ns=event.until_ns,
    )
    out.header.t_ns = t_ns
    return out


def button_event(event: ButtonEvent, step: int, t_ns: int) -> world_pb2.ButtonEvent:
    """A button that was pressed or released in a step."""
    out = world_pb2.ButtonEvent(
        step=step, joint=event.joint, thing=event.thing, pressed=event.pressed, participant=event.participant
    )
    out.header.t_ns = t_ns
    return out


def input_person(p: ParticipantBody) -> world_pb2.WorldInputs.Person:
    """A participant, as recorded with the step in which they joined."""
    out = world_pb2.WorldInputs.Person(participant=p.participant, height_m=p.height, build=p.build)
    if (own := p.proportions) is not None:
        out.proportions.CopyFrom(to_message(own.names, own.joint, own.arrays))
    return out


def thing_message(t: Thing) -> world_pb2.Thing:
    """What a thing is."""
    out = world_pb2.Thing(
        id=t.id,
        name=t.name,
        primitives=[_primitive(p) for p in t.primitives],
        mass_kg=t.mass,
        compliance=t.compliance,
        colour=t.colour,
        shape=t.shape,
        sticky=t.material.sticky,
        bears=t.material.bears if t.material.sticky else 0.0,
        material="" if t.material.elasticity == "elastic" else t.material.elasticity,
        hidden=t.hidden,
    )
    for k in t.looks:
        plain = not k.offset.any() and np.array_equal(k.matrix, np.eye(3))
        look = out.looks.add(model=k.model, matrix=() if plain else k.matrix.ravel().tolist(), colour=k.colour)
        if not plain:
            look.offset.CopyFrom(_vec3(k.offset))
    if t.pages is not None:
        out.pages.models.extend(t.pages.models)
        out.pages.shown, out.pages.by, out.pages.live = t.pages.shown, t.pages.by, t.pages.live
    if t.curve:
        a, straight = t.curve.arc, t.curve.straight
        out.curve.straight.extend(_primitive(p) for p in straight.primitives)
        out.curve.along.CopyFrom(_vec3(a.along))
        out.curve.side.CopyFrom(_vec3(a.side))
        out.curve.centre.CopyFrom(_vec3(a.centre))
        out.curve.low, out.curve.high, out.curve.bend, out.curve.twist = a.low, a.high, a.bend, a.twist
    return out


def dent_message(d: DentRecord) -> world_pb2.Dent:
    """A dent in a thing."""
    return world_pb2.Dent(
        number=d.number, thing=d.thing, shape=_primitive(d.shape), depth=d.depth, left_ns=d.left_ns, fade_s=d.fade_ns * 1e-9
    )


def bond_message(b: Bond) -> world_pb2.Bond:
    """A bond of a limb and a thing."""
    return world_pb2.Bond(
        number=b.number,
        thing=b.thing,
        body=b.body,
        primitive=b.primitive,
        point_thing=_vec3(b.point_thing),
        point_body=_vec3(b.point_body),
        reach=b.reach,
        torn_ns=b.torn_ns,
    )


def bond_torn(t: Torn, step: int, t_ns: int) -> world_pb2.BondTorn:
    """A bond that has torn in a step."""
    out = world_pb2.BondTorn(
        step=step,
        number=t.number,
        thing=t.thing,
        body=t.body,
        primitive=t.primitive,
        point=_vec3(t.point),
        force=t.force,
        gap=t.gap,
    )
    out.header.t_ns = t_ns
    return out


def grasp_message(h: GraspView) -> world_pb2.Grasp:
    """A hand that holds a thing."""
    out = world_pb2.Grasp(
        participant=h.participant,
        right=h.right,
        thing=h.thing,
        hold=_pose(h.position, h.rotation),
        since_ns=h.since_ns,
        fingers=np.rint(1e3 * h.fingers).astype(int).tolist(),
    )
    if not (np.array_equal(h.position, h.seen_position) and np.array_equal(h.rotation, h.seen_rotation)):
        out.seen.CopyFrom(_pose(h.seen_position, h.seen_rotation))
    return out


def _primitive(p: ThingPrimitive) -> world_pb2.Primitive:
    return world_pb2.Primitive(kind=p.kind, params=p.params, pose=_pose(p.position, p.rotation), colour=p.colour)


def _thing_state(s: ThingView) -> world_pb2.ThingState:
    return world_pb2.ThingState(
        id=s.id,
        pose=_pose(s.position, s.rotation),
        velocity=_vec3(s.velocity),
        spin=_vec3(s.spin),
        holders=s.holders,
        resting=s.resting,
    )


def _pose(position: F64, rotation: F64) -> geometry_pb2.Pose:
    x, y, z, w = rotation.tolist()
    return geometry_pb2.Pose(position=_vec3(position), rotation=geometry_pb2.Quaternion(x=x, y=y, z=z, w=w))


def _vec3(v: F64) -> geometry_pb2.Vec3:
    x, y, z = v.tolist()
    return geometry_pb2.Vec3(x=x, y=y, z=z)

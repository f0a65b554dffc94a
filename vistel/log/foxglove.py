"""A log for viewers that show Foxglove's schemas (Foxglove, Lichtblick): people, things and what happens, as an MCAP file.

Limbs and things are sent once, as entities that are locked to a frame of their own (`frame_locked`); after that only transforms
follow. Frames: `world`, z up, is the root, without which nothing is shown; `room` in it is the room, y up; in that are
`ben/left_hand` for each joint and `thing/baton` for each thing.

| topic | schema | what |
|---|---|---|
| `/scene` | foxglove.SceneUpdate | limbs, things, names over heads |
| `/tf` | foxglove.FrameTransforms | where all of it is |
| `/events` | foxglove.Log | touches, grasps, commands with their answers, words |
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log as Event
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.writer import CompressionType, Writer

from vistel.arrays import F64
from vistel.figure.posture.posture import JointPose, Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, JOINTS
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.log import WHOLE_S, Log
from vistel.log.numbers import body_of
from vistel.render.stage.world_view import thing_of
from vistel.space.files.surfaces import pieces_of
from vistel.space.people import Build
from vistel.wire.log import descriptor_set
from vistel.wire.world import recorded
from vistel.wire.world.decoder import RoomState

WORLD = "world"
ROOM = "room"
FPS = 30.0
"""Transforms per second."""
_SKIN = (0.80, 0.62, 0.52)
_CLOTHES = ((0.25, 0.38, 0.62), (0.62, 0.30, 0.28), (0.28, 0.52, 0.36), (0.55, 0.45, 0.25), (0.45, 0.32, 0.58))
_BARE = ("head", "neck", "hand", "thumb", "index", "middle", "ring", "little", "eye", "jaw")
"""Words in the names of joints that no clothes cover."""
_NAME_ABOVE_M = 0.35
"""A name is so far above its head's joint [m]."""
_Z_UP: F64 = np.array([0.5**0.5, 0.0, 0.0, 0.5**0.5])
"""From the room's axes, y up, to those of viewers, z up: quaternion (x, y, z, w)."""


def write_foxglove(log: Log, path: Path, begin: float = 0.0, end: float | None = None, fps: float = FPS) -> int:
    """Write what is between `begin` and `end` [s] of a log, `fps` transforms a second. Returns how many messages. Raises OSError;
    ValueError, one line, where there is nobody and nothing."""
    messages = messages_of(log, begin, end, fps)
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.LZ4)
        writer.start(profile="", library="vistel")
        channels = {topic: _channel(writer, topic, kind) for topic, kind in _TOPICS.items()}
        for number, (t, topic, message) in enumerate(messages):
            t_ns = log.begin_ns + round(t * 1e9)
            writer.add_message(channels[topic], t_ns, message.SerializeToString(), t_ns, number & 0xFFFFFFFF)
        writer.finish()
    return len(messages)


def messages_of(log: Log, begin: float = 0.0, end: float | None = None, fps: float = FPS) -> list[Message]:
    """What `write_foxglove` writes, by time. Raises ValueError, one line, where there is nobody and nothing."""
    people = _people(log, begin, end)
    rooms = list(_rooms(log, begin, end))
    if not people and not rooms:
        raise ValueError(f"{log.path}: nobody and nothing is in it in that time")
    messages = [
        *_limbs(log, people, begin),
        *_things(rooms),
        *_transforms(log, people, rooms, begin, fps),
        *_events(log, rooms, begin, end),
    ]
    return sorted(messages, key=lambda m: m[0])


_TOPICS: dict[str, type[Any]] = {"/scene": SceneUpdate, "/tf": FrameTransforms, "/events": Event}
Message = tuple[float, str, Any]
"""Seconds after the log's beginning, topic, message."""
_Timed = Sequence[tuple[float, Posture]]
_Person = tuple[Build, _Timed]


def _channel(writer: Writer, topic: str, kind: type[Any]) -> int:
    schema = writer.register_schema(kind.DESCRIPTOR.full_name, "protobuf", descriptor_set(kind.DESCRIPTOR))
    return writer.register_channel(topic, "protobuf", schema)


def _people(log: Log, begin: float, end: float | None) -> dict[str, _Person]:
    names = dict.fromkeys([*log.participants, *(m.names["participant"] for m in log.messages("participant"))])
    moved = {name: list(log.postures(name, begin, end)) for name in names}
    return {name: (body_of(log, name), timed) for name, timed in moved.items() if timed}


def _rooms(log: Log, begin: float, end: float | None) -> Iterator[tuple[float, RoomState]]:
    world = recorded.RecordedWorld()
    for record in log.records(*recorded.TOPICS, begin=max(0.0, begin - WHOLE_S), end=end):
        for now in world.take(record):
            t = (now.t_ns - log.begin_ns) * 1e-9
            if t >= begin:
                yield t, now


# -- what there is ----------------------------------------------------------------------------------------------


def _limbs(log: Log, people: dict[str, _Person], begin: float) -> Iterator[Message]:
    for number, (name, (build, timed)) in enumerate(people.items()):
        clothes = _CLOTHES[number % len(_CLOTHES)]
        update = SceneUpdate()
        for joint in sorted(set(build.body.joint.tolist())):
            entity = _entity(update, f"{name}/{JOINTS[joint]}", f"{name}/{JOINTS[joint]}", log.begin_ns + round(timed[0][0] * 1e9))
            colour = _SKIN if any(word in JOINTS[joint] for word in _BARE) else clothes
            for limb in np.flatnonzero(build.body.joint == joint):
                b = build.body
                _limb(entity, b.a[limb], b.b[limb], float(b.radius_a[limb]), float(b.radius_b[limb]), colour)
        sign = _entity(update, f"{name}/name", f"{name}/head", log.begin_ns + round(timed[0][0] * 1e9)).texts.add()
        sign.text, sign.billboard, sign.scale_invariant, sign.font_size = name, True, True, 14.0
        sign.pose.position.y, sign.pose.orientation.w = _NAME_ABOVE_M, 1.0
        _paint(sign.color, (1.0, 1.0, 1.0))
        yield max(begin, timed[0][0]), "/scene", update


def _limb(entity: Any, a: F64, b: F64, radius_a: float, radius_b: float, colour: tuple[float, ...]) -> None:
    """A cone-sphere: a ball at each end, and a cylinder between them that tapers."""
    for centre, radius in ((a, radius_a), (b, radius_b)):
        ball = entity.spheres.add()
        ball.pose.position.x, ball.pose.position.y, ball.pose.position.z = centre.tolist()
        ball.pose.orientation.w = 1.0
        ball.size.x = ball.size.y = ball.size.z = 2.0 * radius
        _paint(ball.color, colour)
    length = float(np.linalg.norm(b - a))
    if length < 1e-6:
        return
    widest = max(radius_a, radius_b)
    between = entity.cylinders.add()
    middle = 0.5 * (a + b)
    between.pose.position.x, between.pose.position.y, between.pose.position.z = middle.tolist()
    _turn(between.pose.orientation, _from_z((b - a) / length))
    between.size.x = between.size.y = 2.0 * widest
    between.size.z = length
    between.bottom_scale, between.top_scale = radius_a / widest, radius_b / widest
    _paint(between.color, colour)


def _from_z(direction: F64) -> F64:
    """The shortest turn that takes +z to a unit vector: quaternion (x, y, z, w)."""
    x, y, z = direction.tolist()
    if z < -0.999999:
        return np.array([1.0, 0.0, 0.0, 0.0])
    q = np.array([-y, x, 0.0, 1.0 + z])
    return q / np.linalg.norm(q)


def _things(rooms: Sequence[tuple[float, RoomState]]) -> Iterator[Message]:
    """Each thing when it is first there and where its shape changes; and that it is gone."""
    known: dict[str, bytes] = {}
    for t, room in rooms:
        update = SceneUpdate()
        for name, thing in room.things.items():
            written = thing.SerializeToString(deterministic=True)
            if known.get(name) != written:
                known[name] = written
                entity = _entity(update, f"thing/{name}", f"thing/{name}", room.t_ns)
                for piece in pieces_of(thing_of(thing), {}, 0.5):
                    mesh = entity.triangles.add()
                    mesh.pose.orientation.w = 1.0
                    for x, y, z in piece.surface.vertices.tolist():
                        mesh.points.add(x=x, y=y, z=z)
                    mesh.indices.extend(piece.surface.triangles.reshape(-1).tolist())
                    _paint(mesh.color, tuple(c / 255.0 for c in piece.colour))
        for name in known.keys() - room.things.keys():
            del known[name]
            gone = update.deletions.add()
            gone.id, gone.type = f"thing/{name}", SceneEntityDeletion.MATCHING_ID
            gone.timestamp.FromNanoseconds(room.t_ns)
        if update.entities or update.deletions:
            yield t, "/scene", update


def _entity(update: SceneUpdate, name: str, frame: str, t_ns: int) -> SceneEntity:
    entity = update.entities.add()
    entity.id, entity.frame_id, entity.frame_locked = name, frame, True
    entity.timestamp.FromNanoseconds(t_ns)
    return entity


def _paint(colour: Any, rgb: Sequence[float]) -> None:
    (colour.r, colour.g, colour.b), colour.a = rgb, 1.0


def _turn(rotation: Any, q: F64) -> None:
    rotation.x, rotation.y, rotation.z, rotation.w = q.tolist()


# -- where it is ------------------------------------------------------------------------------------------------


def _transforms(
    log: Log, people: dict[str, _Person], rooms: Sequence[tuple[float, RoomState]], begin: float, fps: float
) -> Iterator[Message]:
    last = max([*(timed[-1][0] for _, timed in people.values()), *(t for t, _ in rooms[-1:])])
    at = dict.fromkeys(people, 0)
    room = 0
    for n in range(int((last - begin) * fps) + 1):
        t = begin + n / fps
        out = FrameTransforms()
        t_ns = log.begin_ns + round(t * 1e9)
        _frame(out, t_ns, WORLD, ROOM, np.zeros(3), _Z_UP)
        for name, (build, timed) in people.items():
            while at[name] + 1 < len(timed) and timed[at[name] + 1][0] <= t:
                at[name] += 1
            _joints(out, t_ns, name, pose_joints(build.skeleton, timed[at[name]][1]))
        while room + 1 < len(rooms) and rooms[room + 1][0] <= t:
            room += 1
        for name, (p, q) in rooms[room][1].poses.items() if rooms else ():
            _frame(out, t_ns, ROOM, f"thing/{name}", p, q)
        yield t, "/tf", out


def _joints(out: FrameTransforms, t_ns: int, name: str, pose: JointPose) -> None:
    for joint in JOINTS:
        j = JOINT_INDEX[joint]
        _frame(out, t_ns, ROOM, f"{name}/{joint}", pose.position[j], quaternion_from_matrix(np.ascontiguousarray(pose.rotation[j])))


def _frame(out: FrameTransforms, t_ns: int, parent: str, child: str, p: F64, q: F64) -> None:
    transform = out.transforms.add()
    transform.parent_frame_id, transform.child_frame_id = parent, child
    transform.timestamp.FromNanoseconds(t_ns)
    transform.translation.x, transform.translation.y, transform.translation.z = p.tolist()
    _turn(transform.rotation, q)


# -- what happens -----------------------------------------------------------------------------------------------


def _events(log: Log, rooms: Sequence[tuple[float, RoomState]], begin: float, end: float | None) -> Iterator[Message]:
    before: set[str] = set()
    for t, room in rooms:
        now = {f"{k.target} is touched by {k.source}" for k in room.touches}
        now |= {f"{g.participant} holds {g.thing}" for g in room.grasps}
        for text in sorted(now - before):
            yield _event(log, t, "room", text)
        for text in sorted(before - now):
            yield _event(log, t, "room", f"no more: {text}")
        before = now
    for m in log.messages("command", "command_result", "utterance", begin=begin, end=end):
        if m.topic == "command":
            yield _event(log, m.t, m.names["participant"], f"asks: {m.message.WhichOneof('action') or 'nothing'}")
        elif m.topic == "utterance":
            yield _event(log, m.t, m.names["participant"], f"says: {m.message.text}")
        else:
            outcome = m.message.DESCRIPTOR.fields_by_name["outcome"].enum_type.values_by_number[m.message.outcome].name
            yield _event(log, m.t, m.names["participant"], f"{outcome.removeprefix('OUTCOME_').lower()} {m.message.reason}".strip())


def _event(log: Log, t: float, who: str, text: str) -> Message:
    event = Event(level=Event.INFO, name=who, message=text)
    event.timestamp.FromNanoseconds(log.begin_ns + round(t * 1e9))
    return t, "/events", event

"""Numbers of a log by name, as they change over time.

=================================== ==================================================================================
participant.NAME.motion.JOINT.FIELD a joint in the room: x, y, z [m], speed [m/s], angle to its parent [degrees]
thing.ID.FIELD                      a thing: x, y, z [m], speed [m/s], held (how many hold it)
touch.A.B                           1 while two bodies (participants or things) touch, else 0
TOPIC.NAMES.FIELD                   any number in a topic's messages: NAMES are those in braces in its key but for
                                    conference and site, or the site where there are no others; FIELD may be a path with dots
=================================== ==================================================================================

JOINT is a joint of the skeleton (left_hand) or a word for one (left_wrist, right_elbow, left_shoulder, left_knee, ...).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS, Skeleton, standard_skeleton
from vistel.messages.world.decode import person
from vistel.space.inputs import ParticipantBody
from vistel.space.people import Build, build_like, build_of
from vistel.wire.topics import BY_NAME, Delivery, Topic

if TYPE_CHECKING:
    from vistel.log import Log

JOINT_FIELDS = ("x", "y", "z", "speed", "angle")
"""What is known of a joint."""
THING_FIELDS = ("x", "y", "z", "speed", "held")
"""What is known of a thing."""
WORDS = {"wrist": "hand", "elbow": "lower_arm", "knee": "lower_leg", "hip": "upper_leg", "ankle": "foot"}
"""Joints by the words of every day. A `shoulder` is the collar bone's, as in VRM; the arm's is `upper_arm`."""


class UnknownNumberError(ValueError):
    """A name for which a log has no numbers; the text is one line that says what there is."""


@dataclass(frozen=True)
class Track:
    """A number over time: t (N,) seconds after the log's beginning, ascending; value (N,), NaN where not known."""

    t: F64
    value: F64


def tracks(log: Log, names: Sequence[str], begin: float = 0.0, end: float | None = None) -> dict[str, Track]:
    """The numbers of these names from `begin` to `end` [s]. Raises UnknownNumberError for one that the log cannot have."""
    out: dict[str, Track] = {}
    for name in names:
        kind, *parts = name.split(".")
        if kind == "participant":
            _check_joint(log, name, parts)
        elif kind == "thing":
            _check(name, parts[1:], 1, THING_FIELDS)
        elif kind == "touch":
            _check(name, parts[1:], 1, None)
        elif kind not in BY_NAME or BY_NAME[kind].delivery is Delivery.QUERY:
            raise UnknownNumberError(f"{name}: {_no('number', kind, ('participant', 'thing', 'touch', *BY_NAME))}")
    people = dict.fromkeys(name.split(".")[1] for name in names if name.startswith("participant."))
    for who in people:
        asked = [name for name in names if name.startswith(f"participant.{who}.")]
        out |= _joint_tracks(log, who, asked, begin, end)
    in_room = [name for name in names if name.startswith(("thing.", "touch."))]
    if in_room:
        out |= _room_tracks(log, in_room, begin, end)
    for name in names:
        if name not in out:
            out[name] = _field_track(log, name, begin, end)
    return {name: _ascending(out[name]) for name in names}


def _ascending(track: Track) -> Track:
    """In the order of time, which may have gone back where a sender's clock was set."""
    order = np.argsort(track.t, kind="stable")
    return Track(track.t[order], track.value[order])


def with_fields(names: Sequence[str]) -> list[str]:
    """The names, where one of a joint without a field stands for all of its fields."""
    joints = [name for name in names if name.startswith("participant.") and len(name.split(".")) == 4]
    return [full for name in names for full in ([f"{name}.{field}" for field in JOINT_FIELDS] if name in joints else [name])]


def together(found: Iterable[Track]) -> tuple[F64, list[F64]]:
    """All times of some tracks (N,), ascending, and what each was at them (N,): the newest value; NaN before its first."""
    all_tracks = list(found)
    times = np.unique(np.concatenate([t.t for t in all_tracks])) if all_tracks else np.zeros(0)
    held: list[F64] = []
    for track in all_tracks:
        at = np.searchsorted(track.t, times, "right") - 1
        held.append(np.where(at >= 0, track.value[at], np.nan) if len(track.t) else np.full(len(times), np.nan))
    return times, held


def extent(track: Track) -> str:
    """Between which values a number was, in words: who asked for what it never reached sees what it does reach."""
    known = track.value[np.isfinite(track.value)]
    return f"was from {known.min():.4g} to {known.max():.4g}" if len(known) else "has no value in that time"


def skeleton_of(log: Log, participant: str) -> Skeleton:
    """The joint chain of a participant as they announced it; an average one where the log does not hold that."""
    body = _announced(log, participant)
    return body.proportions.skeleton if body.proportions is not None else standard_skeleton(body.height)


def body_of(log: Log, participant: str) -> Build:
    """Joint chain and limbs of a participant, as above."""
    body = _announced(log, participant)
    return build_like(body.proportions) if body.proportions is not None else build_of(body.height, 1.0)


def _announced(log: Log, participant: str) -> ParticipantBody:
    for about in log.messages("participant", participant=participant):
        return person(participant, about.message)
    return ParticipantBody(participant, standard_skeleton().height)


def joint_named(word: str) -> str:
    """The joint that a word means: left_hand, or left_wrist. Raises ValueError, one line, where it means none."""
    side, _, rest = word.partition("_")
    joint = f"{side}_{WORDS[rest]}" if rest in WORDS else word
    if joint not in JOINT_INDEX:
        raise ValueError(_no("joint", word, [*JOINTS, *(f"{side}_{word}" for side in ("left", "right") for word in WORDS)]))
    return joint


def _joint_tracks(log: Log, who: str, names: list[str], begin: float, end: float | None) -> dict[str, Track]:
    skeleton = skeleton_of(log, who)
    times: list[float] = []
    posed: list[tuple[F64, F64]] = []
    asked = [joint_named(name.split(".")[3]) for name in names]
    joints = [JOINT_INDEX[joint] for joint in asked]
    parents = [max(0, int(PARENTS[j])) for j in joints]
    for t, posture in log.postures(who, begin, end):
        pose = pose_joints(skeleton, posture)
        times.append(t)
        turned = np.swapaxes(pose.rotation[parents], 1, 2) @ pose.rotation[joints]
        posed.append((pose.position[joints], turned))
    t = np.array(times)
    at = np.array([p for p, _ in posed]).reshape(-1, len(joints), 3)
    trace = np.array([np.trace(r, axis1=1, axis2=2) for _, r in posed]).reshape(-1, len(joints))
    out: dict[str, Track] = {}
    for n, name in enumerate(names):
        angle = np.degrees(np.arccos(np.clip(0.5 * (trace[:, n] - 1.0), -1.0, 1.0)))
        out[name] = Track(t, _of(name.split(".")[4], t, at[:, n], angle))
    return out


def _room_tracks(log: Log, names: list[str], begin: float, end: float | None) -> dict[str, Track]:
    times: list[float] = []
    at: dict[str, list[tuple[float, ...]]] = {name: [] for name in names}
    seen: set[str] = set()
    for t, room in log.rooms(begin, end):
        times.append(t)
        seen.update(room.things, room.people)
        for name in names:
            kind, one, other = name.split(".")
            if kind == "touch":
                both = (one, other) in room.touching or (other, one) in room.touching
                at[name].append((float(both), 0.0, 0.0, 0.0))
            else:
                thing = room.things.get(one)
                at[name].append((*thing.position, len(thing.holders)) if thing is not None else (np.nan,) * 4)
    for name in names if times else ():
        for body in name.split(".")[1 : 3 if name.startswith("touch.") else 2]:
            if body not in seen:
                raise UnknownNumberError(
                    f"{name}: {_no('thing' if name.startswith('thing') else 'person or thing', body, sorted(seen))}"
                )
    t, out = np.array(times), dict[str, Track]()
    for name in names:
        values = np.array(at[name]).reshape(-1, 4)
        field = "x" if name.startswith("touch.") else name.split(".")[2]
        out[name] = Track(t, _of(field, t, values[:, :3], values[:, 3]))
    return out


def _of(field: str, t: F64, position: F64, other: F64) -> F64:
    """(N,) a coordinate of position (N, 3), the speed at which it changes, or `other`."""
    if field in ("x", "y", "z"):
        return position[:, "xyz".index(field)]
    if field != "speed":
        return other
    out = np.full(len(t), np.nan)
    apart = np.diff(t)
    np.divide(np.linalg.norm(np.diff(position, axis=0), axis=1), apart, out=out[1:], where=apart > 0.0)
    return out


def _field_track(log: Log, name: str, begin: float, end: float | None) -> Track:
    topic = BY_NAME[name.split(".", maxsplit=1)[0]]
    parts = name.split(".")[1:]
    own = _own_names(topic)
    if len(parts) <= len(own):
        raise UnknownNumberError(f"{name}: expected {'.'.join((topic.name, *(o.upper() for o in own), 'FIELD'))}")
    wanted = dict(zip(own, parts, strict=False))
    path = parts[len(own) :]
    times: list[float] = []
    values: list[float] = []
    for found in log.messages(topic.name, begin=begin, end=end, **wanted):
        value = _number(found.message, path, name)
        if value is not None:
            times.append(found.t)
            values.append(value)
    if not times:
        _number(topic.message(), path, name)  # a path that the message does not have is told even where there is no message
    return Track(np.array(times), np.array(values))


def _own_names(topic: Topic) -> tuple[str, ...]:
    return tuple(f for f in topic.fields if f not in ("conference", "site")) or tuple(f for f in topic.fields if f == "site")


def _number(message: Any, path: Sequence[str], name: str) -> float | None:
    """The number at a path of fields and places in lists; None where a list is shorter."""
    value = message
    for part in path:
        if hasattr(value, "DESCRIPTOR"):
            fields = [f.name for f in value.DESCRIPTOR.fields]
            if part not in fields:
                raise UnknownNumberError(f"{name}: {_no('field', part, fields)}")
            value = getattr(value, part)
        elif part.isdecimal() and hasattr(value, "__len__") and not isinstance(value, str | bytes):
            if int(part) >= len(value):
                return None
            value = value[int(part)]
        else:
            raise UnknownNumberError(f"{name}: {part!r} is no place in a list of numbers")
    if isinstance(value, bool | int | float):
        return float(value)
    fields = ", ".join(f.name for f in value.DESCRIPTOR.fields) if hasattr(value, "DESCRIPTOR") else ""
    raise UnknownNumberError(f"{name}: is no number; {f'it has {fields}' if fields else 'name a place in it, such as .0'}")


def _check_joint(log: Log, name: str, parts: Sequence[str]) -> None:
    if len(parts) != 4 or parts[1] != "motion":
        raise UnknownNumberError(f"{name}: expected participant.NAME.motion.JOINT.FIELD")
    if log.participants and parts[0] not in log.participants:
        raise UnknownNumberError(f"{name}: {_no('participant', parts[0], log.participants)}")
    try:
        joint_named(parts[2])
    except ValueError as e:
        raise UnknownNumberError(f"{name}: {e}") from e
    _check(name, parts[3:], 1, JOINT_FIELDS)


def _check(name: str, parts: Sequence[str], count: int, fields: Sequence[str] | None) -> None:
    if len(parts) != count:
        raise UnknownNumberError(f"{name}: expected {'thing.ID.FIELD' if name.startswith('thing') else 'touch.A.B'}")
    if fields is not None and parts[-1] not in fields:
        raise UnknownNumberError(f"{name}: {_no('field', parts[-1], fields)}")


def _no(what: str, word: str, there: Iterable[str]) -> str:
    known = list(there)
    like = get_close_matches(word, known, 1, 0.6)
    return f"no {what} is called {word!r}; " + (f"did you mean {like[0]}?" if like else f"there are {', '.join(known)}")


def spans(times: F64, true: F64) -> Iterator[tuple[float, float]]:
    """(first, last) time [s] of every run of times at which something was true (N,), not 0."""
    on = np.flatnonzero(np.diff(np.concatenate([[0.0], (true != 0.0) & ~np.isnan(true), [0.0]])))
    for first, after in zip(on[::2], on[1::2], strict=True):
        yield float(times[first]), float(times[after - 1])

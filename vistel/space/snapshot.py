"""The world's state as bytes: JSON whose numbers read back exactly, the same bytes for the same state."""

import json
import re
from base64 import b64decode, b64encode
from collections.abc import Callable, Iterable
from functools import lru_cache
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.posture.posture import Posture, Stance
from vistel.geometry.pose import Pose
from vistel.space.arguments import Reaction
from vistel.space.boards.json_values import from_stroke, to_stroke
from vistel.space.dynamics.dynamics import Motions
from vistel.space.hands.approach import Approach
from vistel.space.hands.claims import Claim
from vistel.space.hands.grasp import Grasp
from vistel.space.hands.reach_kernels import PAIRS
from vistel.space.history import Change, History, PlacedThing
from vistel.space.inputs import ParticipantBody, PropInput
from vistel.space.joints.joint import check_joints
from vistel.space.joints.json_values import from_joint, to_joint
from vistel.space.ledger import Ledger
from vistel.space.memory.bonds import Bond
from vistel.space.memory.dents import DentRecord
from vistel.space.people import PersonState
from vistel.space.room import Extra, Room, Seat, meeting_room
from vistel.space.signals import RaisedHand, ShownReaction, Signals
from vistel.space.state import Gesture, LetGo, Pen, State
from vistel.space.things.glide import Glide
from vistel.space.things.json_values import from_primitive, from_thing, to_primitive, to_thing
from vistel.space.things.props import Tracked
from vistel.space.things.things import PhysicsMaterial, Thing
from vistel.space.view import Outcome

VERSION = 9
"""Of this format; a world refuses any other."""


def encode(room: Room, s: State) -> bytes:
    """The state of a meeting room."""
    return _written(_fields(room, s, [_from_extra(e) for e in room.extras]), lambda array: array.tolist())


def digest(room: Room, s: State) -> int:
    """64-bit hash of everything that `encode` writes. Arrays are hashed as bytes, which is faster than as text."""
    arrays: list[bytes] = []

    def aside(array: NDArray[Any]) -> tuple[int, ...]:
        arrays.append(array.astype(np.float64 if array.dtype.kind == "f" else np.int64).tobytes())
        return array.shape

    text = _written(_fields(room, s, _extras_digest(room)), aside)
    return int.from_bytes(blake2b(b"".join([text, *arrays]), digest_size=8).digest(), "little")


@lru_cache(4)
def _extras_digest(room: Room) -> str:
    return blake2b(repr([_from_extra(e) for e in room.extras]).encode(), digest_size=16).hexdigest()


def _written(data: dict[str, Any], array: Callable[[NDArray[Any]], Any]) -> bytes:
    """JSON; array: gives the value written for an array."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False, ensure_ascii=False, default=array).encode()


def _fields(room: Room, s: State, extras: Any) -> dict[str, Any]:
    """All of the state: lists, words, numbers, and arrays of float64 and int64."""
    m = s.motions
    shapes = _Shapes(room)
    # A room from files is included whole, for sites without the files. Its text is made once.
    own: dict[str, Any] = {"room": _from_room(room)} if room.source else {}
    things = [shapes.number(t) for t in s.things]
    history = [[_from_change(c, shapes) for c in some] for some in (s.history.done, s.history.undone)]
    if s.pressed:  # written only when there are some, so that rooms without buttons keep their form
        own["pressed"] = list(s.pressed)
    if s.strokes:  # the same
        own["strokes"] = [from_stroke(k) for k in s.strokes]
    if s.pens:  # the same
        own["pens"] = [[p.participant, p.right, p.board, p.number, p.x, p.y] for p in s.pens]
    if s.signals.raised:  # the same
        own["raised"] = [[h.participant, h.since_ns, h.by_gesture] for h in s.signals.raised]
    if s.signals.reactions:  # the same
        own["reactions"] = [[r.participant, r.reaction.value, r.since] for r in s.signals.reactions]
    if s.gestures:  # the same
        own["gestures"] = [[g.participant, g.kind, g.since] for g in s.gestures]
    return own | {
        "version": VERSION,
        "seats": len(room.seats),
        "extras": extras,
        "step": s.step,
        "t_ns": s.t_ns,
        "shapes": shapes.rows,
        "things": things,
        "position": m.position,
        "rotation": m.rotation,
        "velocity": m.velocity,
        "spin": m.spin,
        "mode": m.mode,
        "still": m.still,
        "figures": [_from_figure(f) for f in s.figures],
        "grasps": [_from_grasp(g) for g in s.grasps],
        "approaches": [_from_approach(a) for a in s.approaches],
        "let_go": [[e.participant, e.right, e.thing, e.step] for e in s.let_go],
        "answers": [[a.id, a.participant, a.done, a.reason, a.step, list(a.things)] for a in s.ledger.answers],
        "allowance": [[who, left] for who, left in s.ledger.allowance],
        "tracked": [_from_tracked(t) for t in s.tracked],
        "felt": [[who, right] for who, right in s.felt],
        "dents": [_from_dent(d) for d in s.dents],
        "bonds": [_from_bond(b) for b in s.bonds],
        "marks": s.marks,
        "glides": [_from_glide(g) for g in s.glides],
        "selected": [[who, list(ids)] for who, ids in s.selected],
        "history": history,
        "claims": [[c.thing, c.owner, c.until_ns] for c in s.claims],
    }


def version_of(data: bytes) -> int | None:
    """The version of a snapshot, also of an unreadable one; None for other bytes."""
    found = re.match(rb'\{"version":(\d{1,9})[,}]', data)
    return int(found[1]) if found else None


def decode(data: bytes, room: Room | None = None, things: Iterable[Thing] = ()) -> tuple[Room, State]:
    """Room and state. Raises ValueError, one line, for bytes that are no snapshot of this version.

    room, things: earlier ones; unchanged parts of them are used again.
    """
    try:
        d = json.loads(data)
        version = d["version"]
    except (ValueError, TypeError, KeyError) as e:
        raise ValueError(f"snapshot: not a snapshot of the world ({e})") from e
    if version != VERSION:
        raise ValueError(f"snapshot: version {version} cannot be read here, only version {VERSION}")
    try:
        if room is None or not _is_of(d, room):
            extras = [_to_extra(e) for e in d["extras"]]
            room = _to_room(d["room"]) if "room" in d else meeting_room(int(d["seats"]), extras)
        return room, _state(d, room, {t.id: t for t in things})
    except (ValueError, TypeError, KeyError, IndexError) as e:
        raise ValueError(f"snapshot: incomplete or damaged ({e!r})") from e


def _is_of(d: dict[str, Any], room: Room) -> bool:
    if "room" in d or room.source:
        return "room" in d and d["room"][0] == room.source
    return int(d["seats"]) == len(room.seats) and d["extras"] == [_from_extra(e) for e in room.extras]


def _shape(row: Any, room: Room, known: dict[str, Thing]) -> Thing:
    if isinstance(row, str):
        return room.by_id[row]
    old = known.get(row["id"])
    return old if old is not None and from_thing(old) == row else to_thing(row)


def _state(d: dict[str, Any], room: Room, known: dict[str, Thing]) -> State:
    n = len(d["things"])
    shapes = [_shape(row, room, known) for row in d["shapes"]]
    done, undone = ([_to_change(c, shapes) for c in some] for some in d["history"])
    motions = Motions(
        _rows(d["position"], n, 3),
        _rows(d["rotation"], n, 4),
        _rows(d["velocity"], n, 3),
        _rows(d["spin"], n, 3),
        np.array(d["mode"], np.int64).reshape(n),
        np.array(d["still"], np.int64).reshape(n),
    )
    if not np.isin(motions.mode, (0, 1, 2, 3)).all():
        raise ValueError("mode")
    return State(
        things=tuple(shapes[int(k)] for k in d["things"]),
        motions=motions,
        step=int(d["step"]),
        t_ns=int(d["t_ns"]),
        figures=tuple(_to_figure(f) for f in d["figures"]),
        grasps=tuple(_to_grasp(g) for g in d["grasps"]),
        approaches=tuple(_to_approach(a) for a in d["approaches"]),
        let_go=tuple(LetGo(str(a), bool(b), str(c), int(e)) for a, b, c, e in d["let_go"]),
        ledger=Ledger(
            tuple(Outcome(str(a), str(b), bool(c), str(e), int(f), tuple(map(str, g))) for a, b, c, e, f, g in d["answers"]),
            tuple((str(who), float(left)) for who, left in d["allowance"]),
        ),
        tracked=tuple(_to_tracked(t) for t in d["tracked"]),
        felt=tuple((str(who), bool(right)) for who, right in d["felt"]),
        dents=tuple(_to_dent(e) for e in d["dents"]),
        bonds=tuple(_to_bond(e) for e in d["bonds"]),
        marks=int(d["marks"]),
        glides=tuple(_to_glide(g) for g in d["glides"]),
        selected=tuple((str(who), tuple(str(t) for t in ids)) for who, ids in d["selected"]),
        history=History(tuple(done), tuple(undone)),
        claims=tuple(Claim(str(thing), str(owner), int(until)) for thing, owner, until in d["claims"]),
        pressed=tuple(str(joint) for joint in d.get("pressed", ())),
        strokes=tuple(to_stroke(k) for k in d.get("strokes", ())),
        pens=tuple(Pen(str(a), bool(b), str(c), int(n), int(x), int(y)) for a, b, c, n, x, y in d.get("pens", ())),
        signals=Signals(
            tuple(RaisedHand(str(who), int(since_ns), bool(own)) for who, since_ns, own in d.get("raised", ())),
            tuple(ShownReaction(str(who), Reaction(str(what)), int(since)) for who, what, since in d.get("reactions", ())),
        ),
        gestures=tuple(Gesture(str(who), str(kind), int(since)) for who, kind, since in d.get("gestures", ())),
    )


@lru_cache(4)
def _from_room(room: Room) -> list[Any]:
    seats = [[s.position.tolist(), s.heading] for s in room.seats]
    joints = [[from_joint(j) for j in room.joints]] if room.joints else []  # rooms without them keep their form
    return [room.source, room.shell, seats, [from_thing(t) for t in room.things], *joints]


def _to_room(d: Any) -> Room:
    source, shell, seats, things, *joints = d
    places = tuple(Seat(_rows(p, 1, 3)[0], float(h)) for p, h in seats)
    found = tuple(to_thing(t) for t in things)
    hinged = tuple(to_joint(j) for some in joints for j in some)
    check_joints(hinged, found)
    return Room(places, found, source=str(source), shell=bool(shell), joints=hinged)


def _from_extra(e: Extra) -> list[Any]:
    m = e.material
    material = m.elasticity, m.recovery, m.sticky, m.bears
    return [e.id, e.name, e.shape, e.size, e.mass, e.rigidity, e.colour, e.x, e.z, *material]


def _to_extra(d: Any) -> Extra:
    name, what, shape, size, mass, rigidity, colour, x, z, elasticity, recovery, sticky, bears = d
    material = PhysicsMaterial(str(elasticity), float(recovery), float(sticky), float(bears))
    numbers = float(size), float(mass), float(rigidity), int(colour), float(x), float(z)
    return Extra(str(name), str(what), str(shape), *numbers, material)


class _Shapes:
    """Descriptions of things, each once: the id for a thing of the room's beginning, else the whole thing."""

    def __init__(self, room: Room) -> None:
        self.rows: list[Any] = []
        self._own = {id(t) for t in room.things}
        self._numbers: dict[int, int] = {}

    def number(self, thing: Thing) -> int:
        """The number of the thing's description."""
        if id(thing) not in self._numbers:
            self._numbers[id(thing)] = len(self.rows)
            self.rows.append(thing.id if id(thing) in self._own else from_thing(thing))
        return self._numbers[id(thing)]


def _from_change(c: Change, shapes: _Shapes) -> list[Any]:
    """With strokes two entries more."""
    things = [c.participant, *([_from_stood(x, shapes) for x in side] for side in (c.before, c.after))]
    ink = [[from_stroke(k) for k in some] for some in (c.rubbed, c.drawn)]
    return things + ink if any(ink) else things


def _from_stood(x: PlacedThing, shapes: _Shapes) -> list[Any]:
    """With dents one entry more."""
    pose = [shapes.number(x.thing), x.position.tolist(), x.rotation.tolist()]
    return [*pose, [_from_dent(d) for d in x.dents]] if x.dents else pose


def _to_change(d: Any, shapes: list[Thing]) -> Change:
    who, *sides = d
    rubbed, drawn = (tuple(to_stroke(k) for k in some) for some in (sides[2:] or ((), ())))
    before, after = (
        tuple(
            PlacedThing(shapes[int(k)], _rows(p, 1, 3)[0], _rows(q, 1, 4)[0], tuple(_to_dent(e) for some in dents for e in some))
            for k, p, q, *dents in side
        )
        for side in sides[:2]
    )
    return Change(str(who), before, after, rubbed, drawn)


def _from_glide(g: Glide) -> list[Any]:
    return [g.participant, g.thing, g.position.tolist(), g.rotation.tolist(), g.shift.tolist(), g.turn.tolist(), g.step, g.lift]


def _to_glide(d: Any) -> Glide:
    who, thing, p, q, shift, turn, step, lift = d
    way = _rows(p, 1, 3)[0], _rows(q, 1, 4)[0], _rows(shift, 1, 3)[0], _rows(turn, 1, 3)[0]
    return Glide(str(who), str(thing), *way, int(step), float(lift))


def _from_dent(d: DentRecord) -> list[Any]:
    return [d.number, d.thing, d.maker, d.primitive, from_primitive(d.shape), d.depth, d.left_ns, d.fade_ns]


def _to_dent(d: Any) -> DentRecord:
    number, thing, maker, primitive, shape, depth, left_ns, fade_ns = d
    shape = to_primitive(shape)
    times = int(left_ns), int(fade_ns)
    return DentRecord(int(number), str(thing), str(maker), int(primitive), shape, float(_rows(depth, 1, 1)[0, 0]), *times)


def _from_bond(b: Bond) -> list[Any]:
    points = b.point_thing.tolist(), b.point_body.tolist()
    return [b.number, b.thing, b.body, b.primitive, *points, b.reach, b.torn_ns, b.torn_force, b.rest]


def _to_bond(d: Any) -> Bond:
    number, thing, body, primitive, at_thing, at_body, reach, torn_ns, force, rest = d
    points = _rows(at_thing, 1, 3)[0], _rows(at_body, 1, 3)[0]
    reach, force, rest = _rows([reach, force, rest], 1, 3)[0].tolist()
    return Bond(int(number), str(thing), str(body), int(primitive), *points, reach, int(torn_ns), force, rest)


def _from_tracked(t: Tracked) -> list[Any]:
    """A thing led by a mouse also has its participant and its pose before."""
    n = t.measured
    row = [n.thing, n.position.tolist(), n.rotation.tolist(), n.t_ns, n.velocity.tolist(), n.spin.tolist(), t.received_ns]
    return [*row, n.led_by, *(a.tolist() for a in t.begun_at)] if n.led_by and t.begun_at is not None else row


def _to_tracked(d: Any) -> Tracked:
    thing, p, q, t_ns, v, w, received_ns, *led = d
    led_by, before, turned = led or ("", None, None)
    speeds = _rows(v, 1, 3)[0], _rows(w, 1, 3)[0]
    measured = PropInput(str(thing), _rows(p, 1, 3)[0], _rows(q, 1, 4)[0], int(t_ns), *speeds, str(led_by))
    return Tracked(measured, int(received_ns), (_rows(before, 1, 3)[0], _rows(turned, 1, 4)[0]) if led else None)


def _rows(values: Any, n: int, width: int) -> F64:
    out = np.array(values, np.float64).reshape(n, width)
    if not np.isfinite(out).all():
        raise ValueError("numbers that are not finite")
    return out


def _from_posture(p: Posture | None) -> Any:
    if p is None:
        return None
    stance = [*p.stance.position.tolist(), float(p.stance.heading)]
    # Snapshots without single joints keep the older form.
    joints = [{name: rotation.tolist() for name, rotation in sorted(p.joints.items())}] if p.joints else []
    return [p.dofs, p.hands, stance, p.gaze, *joints]


def _to_posture(d: Any) -> Posture | None:
    if d is None:
        return None
    stance = np.array(d[2], np.float64)
    return Posture(
        np.array(d[0], np.float64).reshape(25),
        np.array(d[1], np.float64).reshape(2, 20),
        Stance(stance[:3], float(stance[3])),
        np.array(d[3], np.float64).reshape(2),
        {str(name): _rows(rotation, 1, 3)[0] for name, rotation in d[4].items()} if len(d) > 4 else {},
    )


def _from_figure(f: PersonState) -> dict[str, Any]:
    return {
        "person": _from_person(f.person),
        "posture": _from_posture(f.posture),
        "before": _from_posture(f.before),
        "seq": f.seq,
        "t_ns": f.t_ns,
        "before_t_ns": f.before_t_ns,
        "appeared": f.appeared,
    }


def _from_person(p: ParticipantBody) -> list[Any]:
    """One more entry with proportions. Snapshots without them keep the older form."""
    standard = [p.participant, p.height, p.build]
    if (own := p.proportions) is None:
        return standard
    return [*standard, [list(own.names), list(own.joint), b64encode(own.numbers).decode()]]


def _to_person(d: Any) -> ParticipantBody:
    name, height, build, *rest = d
    own = None
    if rest:
        names, joint, numbers = rest[0]
        own = Proportions(tuple(str(n) for n in names), tuple(int(j) for j in joint), b64decode(numbers, validate=True))
        own = Proportions.from_arrays(own.names, own.joint, *own.arrays)
    return ParticipantBody(str(name), float(height), float(build), own)


def _to_figure(d: dict[str, Any]) -> PersonState:
    return PersonState(
        _to_person(d["person"]),
        _to_posture(d["posture"]),
        _to_posture(d["before"]),
        int(d["seq"]),
        int(d["t_ns"]),
        int(d["before_t_ns"]),
        int(d["appeared"]),
    )


def _from_approach(a: Approach) -> list[Any]:
    numbers = a.aperture, a.play, a.widest, a.loosest, a.speed, a.quickest
    return [a.participant, a.right, a.thing, *(x.tolist() for x in numbers)]


def _to_approach(d: Any) -> Approach:
    who, right, thing, *numbers = d
    return Approach(str(who), bool(right), str(thing), *_rows(numbers, 6, PAIRS))


def _from_grasp(g: Grasp) -> dict[str, Any]:
    return {
        "participant": g.participant,
        "right": g.right,
        "thing": g.thing,
        "start": [g.start.position.tolist(), g.start.rotation.tolist()],
        "aim": [g.aim.position.tolist(), g.aim.rotation.tolist()],
        "since_ns": g.since_ns,
        "engaged": list(g.engaged),
        "pairs": list(g.pairs),
        "aperture": g.aperture.tolist(),
        "tightest": g.tightest.tolist(),
        "touched": g.touched.tolist(),
        "fingers": g.fingers.tolist(),
        "laid": [g.laid.position.tolist(), g.laid.rotation.tolist()],
        "shift": g.shift.tolist(),
        "off": g.off,
        "strained": g.strained,
    }


def _to_grasp(d: dict[str, Any]) -> Grasp:
    start, aim, laid = (Pose(_rows(p, 1, 3)[0], _rows(q, 1, 4)[0]) for p, q in (d["start"], d["aim"], d["laid"]))
    return Grasp(
        str(d["participant"]),
        bool(d["right"]),
        str(d["thing"]),
        start,
        aim,
        int(d["since_ns"]),
        tuple(bool(e) for e in d["engaged"]),
        tuple(bool(e) for e in d["pairs"]),
        _rows(d["aperture"], 1, PAIRS)[0],
        _rows(d["tightest"], 1, PAIRS)[0],
        _rows(d["touched"], 1, PAIRS)[0],
        _rows(d["fingers"], 1, 20)[0],
        laid,
        _rows(d["shift"], 1, 3)[0],
        int(d["off"]),
        int(d["strained"]),
    )

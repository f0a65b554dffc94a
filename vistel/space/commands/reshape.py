"""Things made larger, longer, bent, twisted, put together, taken apart: always groups of implicit primitives again.

What the kinds of primitive cannot say exactly is said by the nearest they can: a bar stretched across stays round, with
the cross-section's area right; a superquadric or a ring stretched along none of its own axes keeps these.
"""

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.space.actions import Refused
from vistel.space.boards.board import SHAPE as BOARD
from vistel.space.dynamics.solids import Solids, outline
from vistel.space.things.arc import Arc
from vistel.space.things.things import Curve, GraspAxis, Look, Part, Thing, ThingPrimitive

SMALLEST = 0.004
"""Least radius about its centre that a thing may have [m]."""
LARGEST = 0.8
"""Largest such radius [m]."""
LARGEST_PANEL = 4.0
"""That of a panel or a board, which stands on the floor [m]."""
THINNEST = 0.002
HEAVIEST = 50.0
MOST_BEND = math.radians(300.0)
MOST_PRIMITIVES = 64
ALIGNED = math.cos(math.radians(30.0))
SLICE = math.radians(9.0)
FLAT_END = 0.3
"""Exponent of the edge of a slice."""


def extent(s: Solids) -> F64:
    """(2, 3) lowest and highest corner of a single thing, in its frame, from the contact points on its surface."""
    reach = s.contact_point_radius[:, None]
    return np.stack([(s.contact_point - reach).min(axis=0), (s.contact_point + reach).max(axis=0)])


def longest_axis(thing: Thing) -> int:
    """Which of its own axes a thing is longest along; the first of equals."""
    low, high = extent(outline(thing))
    return int(np.argmax((high - low).round(6)))


def scaled(thing: Thing, factor: float) -> Thing:
    """The thing `factor` times as large in all directions, its mass with it."""

    def one(p: ThingPrimitive) -> ThingPrimitive:
        lengths = _lengths(p)
        params = tuple(v * factor if k in lengths else v for k, v in enumerate(p.params))
        return replace(p, params=params, position=factor * p.position)

    parts = tuple(replace(p, thing=scaled(p.thing, factor), position=factor * p.position) for p in thing.parts)
    axes = tuple(GraspAxis(factor * a.point, a.direction, factor * a.radius) for a in thing.axes)
    curve = thing.curve and Curve(scaled(thing.curve.straight, factor), thing.curve.arc.scaled(factor))
    thing = _pulled_looks(replace(thing, axes=axes, parts=parts, curve=curve), factor * np.eye(3))
    return sound(_made_of(thing, map(one, thing.primitives), thing.mass * factor**3))


def stretched(thing: Thing, factor: float, along: F64) -> Thing:
    """The thing `factor` times as long in the direction `along` (3,), a unit vector of its frame."""
    if thing.curve:
        straight = stretched(thing.curve.straight, factor, along)
        return curved(straight, thing.curve.arc.bend, thing.curve.arc.twist, thing.curve.arc.side)
    primitives = [_stretched(p, factor, along) for p in thing.primitives]
    parts: list[Part] = []
    for p in thing.parts:
        inner = matrix_from_quaternion(p.rotation).T @ along
        parts.append(replace(p, thing=stretched(p.thing, factor, inner), position=_pulled(p.position, factor, along)))
    axes: list[GraspAxis] = []
    for a in thing.axes:
        direction = _pulled(a.direction, factor, along)
        length = _length(direction)
        axes.append(GraspAxis(_pulled(a.point, factor, along), direction / length, a.radius * math.sqrt(factor / length)))
    thing = _pulled_looks(replace(thing, axes=tuple(axes), parts=tuple(parts)), np.eye(3) + (factor - 1.0) * np.outer(along, along))
    return sound(_made_of(thing, primitives, thing.mass * factor))


def curved(thing: Thing, bend: float, twist: float, side: F64) -> Thing:
    """The straight thing bent towards `side` (3,) and twisted, by angles from end to end [rad], about its longest axis.

    What lies along that axis is cut into slices, each of which is moved as a whole; bars become chains. Raises Refused
    for what is too much.
    """
    if abs(bend) > MOST_BEND or abs(twist) > MOST_BEND:
        raise Refused(f"the {thing.name} can be bent or twisted by {math.degrees(MOST_BEND):.0f} degrees at most")
    if thing.parts:
        raise Refused(f"the {thing.name} is put together; take it apart and bend its parts")
    if abs(bend) < 1e-6 and abs(twist) < 1e-6:
        return replace(thing, curve=None)
    k = longest_axis(thing)
    along = np.eye(3)[k]
    side = side - (side @ along) * along
    if _length(side) < 1e-3:
        side = np.eye(3)[(k + 1) % 3]
    side = side / _length(side)
    low, high = extent(outline(thing))[:, k].tolist()
    if abs(bend) < 1e-6 and all(p.kind in ("sphere", "cone_sphere") and _on_axis(p, along) for p in thing.primitives):
        raise Refused(f"the {thing.name} is round about its axis; twisting it would show nothing")
    count = min(14, max(4, math.ceil(max(abs(bend), abs(twist)) / SLICE)))
    arc = Arc(along, side, low, high, bend, twist, np.zeros(3))
    primitives = [q for p in thing.primitives for q in _sliced(p, arc, count)]
    if len(primitives) == len(thing.primitives):
        raise Refused(f"the {thing.name} is too short to be bent")
    if len(primitives) > MOST_PRIMITIVES:
        raise Refused(f"the {thing.name} has too many parts to be bent ({len(thing.primitives)})")
    centre: F64 = np.mean([_middle(p) for p in primitives], axis=0)
    arc = replace(arc, centre=centre)
    primitives = [replace(p, position=p.position - centre) for p in primitives]
    axes = tuple(GraspAxis(arc.point(0.5 * (low + high)), along, a.radius) for a in thing.axes[:1])
    return sound(replace(thing, primitives=tuple(primitives), axes=axes, curve=Curve(thing, arc), inertia=None))


def joined(a: Thing, at: tuple[F64, F64], b: Thing, b_at: tuple[F64, F64]) -> tuple[Thing, F64]:
    """One thing of two that stand at poses `at`, `b_at` (position, rotation in the room), and where it stands; its axes are
    a's. The colours of both stay."""
    if len(a.primitives) + len(b.primitives) > MOST_PRIMITIVES:
        raise Refused(f"the {a.name} and the {b.name} together have too many parts")
    mass = a.mass + b.mass
    centre = (a.mass * at[0] + b.mass * b_at[0]) / mass
    turn = matrix_from_quaternion(at[1])
    parts: list[Part] = []
    primitives: list[ThingPrimitive] = []
    looks: list[Look] = []
    for thing, (position, rotation) in ((a, at), (b, b_at)):
        inner = turn.T @ matrix_from_quaternion(rotation)
        offset = turn.T @ (position - centre)
        parts.append(Part(thing, offset, quaternion_from_matrix(np.ascontiguousarray(inner))))
        if thing.curve:  # a look is bent with the whole of a thing: what is only part of one is drawn by its primitives
            thing = unveiled(thing)  # noqa: PLW2901
        looks += [k.placed(inner, offset) for k in thing.looks]
        for p in thing.primitives:
            own = inner @ matrix_from_quaternion(p.rotation)
            primitives.append(
                replace(
                    p,
                    position=offset + inner @ p.position,
                    colour=p.colour or thing.colour,
                    rotation=quaternion_from_matrix(np.ascontiguousarray(own)),
                )
            )
    axes = tuple(replace(axis, point=axis.point + parts[0].position) for axis in a.axes)
    whole = replace(
        a,
        name=f"{a.name} with {b.name}",
        shape="group",
        primitives=tuple(primitives),
        mass=mass,
        axes=axes,
        compliance=min(a.compliance, b.compliance),
        parts=tuple(parts),
        curve=None,
        looks=tuple(looks),
        inertia=None,
        hidden=a.hidden and b.hidden,
    )
    return whole, centre


def painted(thing: Thing, colour: int) -> Thing:
    """The thing in one colour, 0xRRGGBBAA, its parts as well."""
    parts = tuple(replace(p, thing=painted(p.thing, colour)) for p in thing.parts)
    curve = thing.curve and replace(thing.curve, straight=painted(thing.curve.straight, colour))
    primitives = tuple(replace(p, colour=0) if p.seen else p for p in thing.primitives)
    looks = tuple(replace(k, colour=colour) for k in thing.looks)
    return replace(thing, colour=colour, primitives=primitives, parts=parts, curve=curve, looks=looks)


def unveiled(thing: Thing) -> Thing:
    """The thing without looks, its primitives drawn."""
    primitives = tuple(p if p.seen else replace(p, colour=0) for p in thing.primitives)
    return replace(thing, primitives=primitives, looks=())


def hardened(thing: Thing, rigidity: float) -> Thing:
    """The thing with another rigidity, 0 as soft as flesh .. 1 rigid."""
    parts = tuple(replace(p, thing=hardened(p.thing, rigidity)) for p in thing.parts)
    curve = thing.curve and replace(thing.curve, straight=hardened(thing.curve.straight, rigidity))
    return replace(thing, compliance=1.0 - rigidity, parts=parts, curve=curve)


def _pulled_looks(thing: Thing, matrix: F64) -> Thing:
    """Its looks and inertia under a linear map of its frame."""
    looks = tuple(k.placed(matrix, np.zeros(3)) for k in thing.looks)
    own = thing.inertia
    if own is not None:
        second = matrix @ (0.5 * np.trace(own) * np.eye(3) - own) @ matrix.T  # mean x x^T
        own = np.trace(second) * np.eye(3) - second
    return replace(thing, looks=looks, inertia=own)


def _made_of(thing: Thing, primitives: Iterable[ThingPrimitive], mass: float) -> Thing:
    try:
        return replace(thing, primitives=tuple(primitives), mass=min(HEAVIEST, max(1e-3, mass)))
    except ValueError as e:
        raise Refused(f"the {thing.name} would be too large or too small") from e


def sound(thing: Thing) -> Thing:
    """The thing, if it is of a size that things may have. Raises Refused."""
    radius = float(outline(thing).radius[0])
    thinnest = min(v for p in thing.primitives for k, v in enumerate(p.params) if k in _sizes(p))
    largest = LARGEST_PANEL if thing.pages or thing.shape == BOARD else LARGEST
    if not (SMALLEST <= radius <= largest and thinnest >= THINNEST):
        raise Refused(
            f"the {thing.name} would be {2e2 * radius:.3g} cm long and {2e2 * thinnest:.2g} cm thin; "
            f"things may be {2e2 * SMALLEST:.1f} to {2e2 * largest:.0f} cm long and no thinner than {2e2 * THINNEST:.1f} cm"
        )
    return thing


def _lengths(p: ThingPrimitive) -> range | tuple[int, ...]:
    """Which numbers of a primitive are lengths."""
    return {"superellipsoid": (0, 1, 2), "supertoroid": (0, 1, 2)}.get(p.kind, range(len(p.params)))


def _sizes(p: ThingPrimitive) -> tuple[int, ...]:
    """Which numbers of a primitive say how thick it is."""
    return {"sphere": (0,), "cone_sphere": (6, 7), "rounded_polygon": (0,)}.get(p.kind, (0, 1, 2))


def _pulled(v: F64, factor: float, along: F64) -> F64:
    """A vector stretched in the direction `along`."""
    return v + (factor - 1.0) * (v @ along) * along


def _length(v: F64) -> float:
    return float(np.sqrt(v @ v))


def _stretched(p: ThingPrimitive, factor: float, along: F64) -> ThingPrimitive:
    u = matrix_from_quaternion(p.rotation).T @ along
    position = _pulled(p.position, factor, along)
    q = p.params
    if p.kind == "sphere":
        return replace(
            p,
            kind="superellipsoid",
            params=(q[0], q[0], q[0] * factor, 1.0, 1.0),
            position=position,
            rotation=quaternion_from_matrix(np.ascontiguousarray(_with_z(along))),
        )
    if p.kind == "cone_sphere":
        a, b = np.array(q[:3]), np.array(q[3:6])
        new_a, new_b = _pulled(a, factor, u), _pulled(b, factor, u)
        d = _length(b - a)
        across = math.sqrt(factor * d / _length(new_b - new_a)) if d > 1e-9 else factor ** (1 / 3)
        return replace(p, params=(*new_a.tolist(), *new_b.tolist(), q[6] * across, q[7] * across), position=position)
    if p.kind == "rounded_polygon":
        corners = np.array(q[1:]).reshape(-1, 3)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        new = [_pulled(c, factor, u) for c in corners]
        thick = _length(_pulled(normal / _length(normal), factor, u))
        return replace(p, params=(q[0] * thick, *np.concatenate(new).tolist()), position=position)
    sizes = [q[k] * math.sqrt(1.0 + (factor * factor - 1.0) * float(u[k]) ** 2) for k in range(3)]
    return replace(p, params=(*sizes, *q[3:]), position=position)


def _with_z(z: F64) -> F64:
    """A rotation whose third column is the unit vector z."""
    other = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(other, z)
    x /= _length(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _on_axis(p: ThingPrimitive, along: F64) -> bool:
    """A round primitive that twisting about `along` does not change."""
    r = matrix_from_quaternion(p.rotation)
    ends = [np.zeros(3)] if p.kind == "sphere" else [np.array(p.params[:3]), np.array(p.params[3:6])]
    points = [r @ e + p.position for e in ends]
    return all(_length(x - (x @ along) * along) < 1e-6 for x in points)


def _middle(p: ThingPrimitive) -> F64:
    if p.kind == "cone_sphere":
        ends = 0.5 * (np.array(p.params[:3]) + np.array(p.params[3:6]))
        return p.position + matrix_from_quaternion(p.rotation) @ ends
    return p.position


def _carried(p: ThingPrimitive, arc: Arc, s: float) -> ThingPrimitive:
    """A primitive moved as a whole with the cross-section at s."""
    turn, off = arc.turn(s), p.position - s * arc.along
    own = turn @ matrix_from_quaternion(p.rotation)
    return replace(p, position=arc.point(s) + turn @ off, rotation=quaternion_from_matrix(np.ascontiguousarray(own)))


def _sliced(p: ThingPrimitive, arc: Arc, count: int) -> list[ThingPrimitive]:
    """The primitive cut across the arc's axis and bent with it."""
    along = arc.along
    local = matrix_from_quaternion(p.rotation).T @ along
    if p.kind == "cone_sphere":
        return _bar_slices(p, arc, count)
    k = int(np.argmax(np.abs(local)))
    size = p.params[k] if p.kind == "superellipsoid" else 0.0
    if abs(local[k]) < ALIGNED or size < 0.15 * (arc.high - arc.low):
        return [_carried(p, arc, float(p.position @ along))]
    return _slab_slices(p, arc, count, k)


def _bar_slices(p: ThingPrimitive, arc: Arc, count: int) -> list[ThingPrimitive]:
    r = matrix_from_quaternion(p.rotation)
    a, b = r @ np.array(p.params[:3]) + p.position, r @ np.array(p.params[3:6]) + p.position
    cuts: list[tuple[F64, float]] = []
    for t in np.linspace(0.0, 1.0, count + 1).tolist():
        cuts.append((arc.moved(a + t * (b - a)), p.params[6] + t * (p.params[7] - p.params[6])))
    zero, upright = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    return [
        replace(p, params=(*x.tolist(), *y.tolist(), rx, ry), position=zero, rotation=upright)
        for (x, rx), (y, ry) in pairwise(cuts)
    ]


def _slab_slices(p: ThingPrimitive, arc: Arc, count: int, k: int) -> list[ThingPrimitive]:
    """Slabs of a superellipsoid across its axis k."""
    a1, a2, a3, e1, e2 = p.params
    along = arc.along
    r = matrix_from_quaternion(p.rotation)
    half = p.params[k] / count
    out: list[ThingPrimitive] = []
    for n in range(count):
        u = (2 * n + 1) / count - 1.0
        if k == 2:
            c = _profile(u, e1)
            params, turn = (a1 * c, a2 * c, half, FLAT_END, e2), np.eye(3)
        else:
            rim, crown = _profile(u, e2), _profile(u, e1)
            across = (a2 if k == 0 else a1) * rim
            params, turn = (across, a3 * crown, half, FLAT_END, e1), _OTHER[k]
        if min(params[:2]) < THINNEST:
            continue
        centre = p.position + r @ (np.eye(3)[k] * u * p.params[k])
        local = quaternion_from_matrix(np.ascontiguousarray(r @ turn))
        slab = replace(p, params=(params[0], params[1], half * 1.35, FLAT_END, params[4]), position=centre, rotation=local)
        out.append(_carried(slab, arc, float(centre @ along)))
    return out


_OTHER: dict[int, F64] = {
    0: np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    1: np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}
"""The frame of a slab across X or Y: its Z along that axis, its X across, its Y up the profile."""


def _profile(u: float, e: float) -> float:
    """How wide a superellipse of exponent e is at u of its height."""
    return (1.0 - abs(u) ** (2.0 / e)) ** (e / 2.0)

"""Things as JSON values whose numbers read back exactly."""

from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.space.things.arc import Arc
from vistel.space.things.things import BEARS, Curve, GraspAxis, Look, Pages, Part, PhysicsMaterial, Thing, ThingPrimitive


def from_thing(t: Thing) -> dict[str, Any]:
    """A thing as JSON values."""
    m = t.material
    own: dict[str, Any] = {}  # written only when set, so that other things keep their form
    if t.looks:
        own["looks"] = [[k.model, k.matrix.tolist(), k.offset.tolist(), k.colour] for k in t.looks]
    if t.inertia is not None:
        own["inertia"] = t.inertia.tolist()
    if t.hidden:
        own["hidden"] = True
    if t.pages is not None:
        own["pages"] = [list(t.pages.models), t.pages.shown, t.pages.by, *([True] if t.pages.live else [])]
    return own | {
        "id": t.id,
        "name": t.name,
        "shape": t.shape,
        "primitives": [from_primitive(p) for p in t.primitives],
        "mass": t.mass,
        "compliance": t.compliance,
        "colour": t.colour,
        "position": t.position.tolist(),
        "rotation": t.rotation.tolist(),
        "axes": [[a.point.tolist(), a.direction.tolist(), a.radius] for a in t.axes],
        "matter": [m.elasticity, m.recovery, m.sticky] + ([m.bears] if m.bears != BEARS else []),
        "parts": [[from_thing(p.thing), p.position.tolist(), p.rotation.tolist()] for p in t.parts],
        "curve": t.curve and [from_thing(t.curve.straight), *_from_arc(t.curve.arc)],
    }


def to_thing(d: Any) -> Thing:
    """The thing. Raises ValueError, TypeError or KeyError for invalid values."""
    elasticity, recovery, sticky, *bears = d["matter"]
    curve, inertia = d["curve"], d.get("inertia")
    return Thing(
        str(d["id"]),
        str(d["name"]),
        str(d["shape"]),
        tuple(to_primitive(p) for p in d["primitives"]),
        float(d["mass"]),
        float(d["compliance"]),
        int(d["colour"]),
        _numbers(d["position"], 3),
        _numbers(d["rotation"], 4),
        tuple(GraspAxis(_numbers(p, 3), _numbers(u, 3), float(r)) for p, u, r in d["axes"]),
        PhysicsMaterial(str(elasticity), float(recovery), float(sticky), *map(float, bears)),
        tuple(Part(to_thing(t), _numbers(p, 3), _numbers(q, 4)) for t, p, q in d["parts"]),
        Curve(to_thing(curve[0]), _to_arc(curve[1:])) if curve else None,
        tuple(Look(str(k), _numbers(m, 9).reshape(3, 3), _numbers(o, 3), int(c)) for k, m, o, c in d.get("looks", ())),
        None if inertia is None else _numbers(inertia, 9).reshape(3, 3),
        bool(d.get("hidden", False)),
        _to_pages(*d["pages"]) if "pages" in d else None,
    )


def _to_pages(models: Any, shown: Any, by: Any, live: Any = False) -> Pages:
    pages = Pages(tuple(str(m) for m in models), int(shown), str(by), bool(live))
    if not 0 <= pages.shown < len(pages.models):
        raise ValueError("a page that is not there")
    return pages


def _from_arc(a: Arc) -> list[Any]:
    return [a.along.tolist(), a.side.tolist(), a.low, a.high, a.bend, a.twist, a.centre.tolist()]


def _to_arc(d: Any) -> Arc:
    along, side, low, high, bend, twist, centre = d
    angles = float(bend), float(twist)
    return Arc(_numbers(along, 3), _numbers(side, 3), float(low), float(high), *angles, _numbers(centre, 3))


def from_primitive(p: ThingPrimitive) -> list[Any]:
    """A primitive as a list."""
    return [p.kind, list(p.params), p.position.tolist(), p.rotation.tolist(), p.colour]


def to_primitive(d: Any) -> ThingPrimitive:
    """The primitive. Raises ValueError or TypeError for invalid values."""
    kind, params, position, rotation, colour = d
    return ThingPrimitive(str(kind), tuple(float(x) for x in params), _numbers(position, 3), _numbers(rotation, 4), int(colour))


def _numbers(values: Any, n: int) -> F64:
    out = np.array(values, np.float64).reshape(n)
    if not np.isfinite(out).all():
        raise ValueError("numbers that are not finite")
    return out

"""Joints as JSON values whose numbers read back exactly. Infinite limits and forces are null."""

import math
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.space.joints.joint import Button, Detent, Drive, Joint, JointFrame, JointKind


def from_joint(j: Joint) -> dict[str, Any]:
    """A joint as JSON values."""
    d, b = j.drive, j.button
    return {
        "id": j.id,
        "kind": j.kind.value,
        "bodies": [j.base, j.thing],
        "frames": [[f.point.tolist(), f.rotation.tolist()] for f in (j.on_base, j.on_thing)],
        "limits": [_finite(j.lower), _finite(j.upper)],
        "drive": [d.stiffness, d.damping, d.target, _finite(d.most)],
        "detents": [[x.at, x.reach, x.force] for x in j.detents],
        "button": b and [b.press, b.release, b.lights, b.lit],
        "collides": j.collides,
    }


def to_joint(d: Any) -> Joint:
    """The joint. Raises ValueError, TypeError or KeyError for invalid values."""
    base, thing = d["bodies"]
    on_base, on_thing = (JointFrame(_numbers(p, 3), _numbers(q, 4)) for p, q in d["frames"])
    lower, upper = d["limits"]
    stiffness, damping, target, most = d["drive"]
    button = d["button"]
    return Joint(
        str(d["id"]),
        JointKind(d["kind"]),
        str(thing),
        str(base),
        on_base,
        on_thing,
        -math.inf if lower is None else float(lower),
        math.inf if upper is None else float(upper),
        Drive(float(stiffness), float(damping), float(target), math.inf if most is None else float(most)),
        tuple(Detent(*map(float, x)) for x in d["detents"]),
        None if button is None else Button(float(button[0]), float(button[1]), str(button[2]), int(button[3])),
        bool(d["collides"]),
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _numbers(values: Any, n: int) -> F64:
    return np.array(values, np.float64).reshape(n)

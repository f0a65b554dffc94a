"""A face in ARKit's shapes, which the morph targets of an avatar in glTF are named after."""

from functools import cache

import numpy as np

from vistel.arrays import F64
from vistel.figure.face.rules import OneSided, builtin_rules
from vistel.figure.face.shape import Expression

_WHOLE = ("browInnerUp", "cheekPuff")
"""Shapes of both sides where the rules' units have two."""
_BLINK = ("eyeBlinkLeft", "eyeBlinkRight")
"""What lids that are seen drive, in the order of `Expression.lids`."""


def _shapes_of(unit: OneSided) -> dict[str, float]:
    side = {0: "", 1: "Left", -1: "Right"}[unit.side]
    return {name if name in _WHOLE else f"{name}{side}": share for name, share in unit.unit.arkit.items()}


SHAPES: tuple[str, ...] = tuple(dict.fromkeys(name for unit in builtin_rules().units for name in _shapes_of(unit)))
"""Names of the shapes that the built-in rules drive."""


def coefficients(expression: Expression) -> F64:
    """(len(SHAPES),) 0 to 1, of an expression under the built-in rules. Of both sides of a whole shape the larger counts."""
    parts = _shares() * expression.intensity[:, None]
    out: F64 = parts.max(axis=0)
    for name, lid in zip(_BLINK, expression.lids, strict=True):
        at = SHAPES.index(name)
        out[at] = max(out[at], 1.0 - lid)
    return np.clip(out, 0.0, 1.0)


@cache
def _shares() -> F64:
    """(K, len(SHAPES)) how much of each shape a unit at 1 shows."""
    units = builtin_rules().units
    out = np.zeros((len(units), len(SHAPES)))
    for row, unit in zip(out, units, strict=True):
        for name, share in _shapes_of(unit).items():
            row[SHAPES.index(name)] = share
    return out

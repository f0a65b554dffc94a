"""A look whose body measures what is wanted: height and weight as told, the rest as people of that height and weight have it.

Unknown are the model's numbers (`UNKNOWNS`); each has its usual value and spread, each measure the spread that people have about
what their height and weight lead to expect (ANSUR II). The sum of squares of both is made small, by steps of Gauss and Newton with
a Jacobian that the model's file keeps for each sex and that is corrected after every step (Broyden 1965)."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.body_model.look import Look
from vistel.figure.body_model.measures import COLUMNS, measures
from vistel.figure.body_model.model import BodyModel, Shape

FILE = Path(__file__).with_name("data") / "ansur.toml"
DENSITY = 1000.0
"""Of a body with air in its lungs [kg/m^3]; Krzywicki and Chinn 1967: 1.00 to 1.07 without."""
ADULT = 18.0
"""From this age on the measures of adults are expected [years]."""
_NUMBERS = {"height": 0.30, "weight": 0.40, "muscle": 0.30, "proportions": 0.25}
_DETAILS = (
    "measure-shoulder-dist", "measure-upperarm-length", "measure-lowerarm-length", "measure-upperarm-circ",
    "measure-bust-circ", "measure-underbust-circ", "measure-waist-circ", "measure-hips-circ", "measure-napetowaist-dist",
    "measure-waisttohip-dist", "torso-scale-horiz", "torso-scale-depth", "torso-scale-vert", "torso-vshape",
    "hip-scale-horiz", "hip-scale-depth", "measure-thigh-circ", "measure-calf-circ", "measure-knee-circ",
    "measure-ankle-circ", "measure-wrist-circ", "measure-neck-circ", "upperlegs-height", "lowerlegs-height", "hand-scale",
    "hand-fingers-length", "hand-fingers-diameter", "foot-scale", "foot-scale-horiz", "foot-scale-depth", "head-scale-depth",
    "head-scale-horiz", "head-scale-vert", "head-back-scale-depth", "ear-scale", "ear-scale-vert", "ear-scale-depth",
    "foot-scale-vert", "eye-trans", "chin-height", "lowerarm-fat", "upperarm-fat", "upperleg-fat", "lowerleg-fat",
    "stomach-tone", "buttocks-volume", "cheek-bones", "neck-scale-horiz", "neck-scale-depth",
)  # fmt: skip
UNKNOWNS = (*_NUMBERS, *_DETAILS)
"""The model's numbers that are solved for."""
SPREAD = 0.30
"""Of details about their usual value."""
_CLOSE_M = 3e-4
"""Spread of the height [m]: what is left of it is scaled away."""
_CLOSE_KG = 0.05
"""Spread of the weight [kg]."""
_TOLD = 0.002
"""Spread that a measure has which is told [m]."""
_ROUNDS = 14
_ALL = ("weight", *COLUMNS)


@dataclass(frozen=True)
class Fitted:
    """A look, and the shape of it with exactly the height wanted. weight: reached [kg]."""

    look: Look
    shape: Shape
    weight: float


@cache
def statistics() -> dict[str, dict[str, dict[str, Any]]]:
    """ANSUR II by sex ("male", "female") and measure: see the head of the file."""
    return tomllib.loads(FILE.read_text("utf-8"))


def expected(sex: str, height: float, weight: float) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of each measure of people of that height [m] and weight [kg]; measures in metres."""
    out: dict[str, tuple[float, float]] = {}
    for name, row in statistics()[sex].items():
        constant, by_height, by_weight, left = row["by"]
        out[name] = constant + by_height * height + by_weight * float(np.cbrt(weight)), left
    return out


def _differing(sex: str, name: str, mean: float, by: float) -> float:
    """What differs from the mean does not leave the middle nine tenths of people for it."""
    _, low, _, high, _ = statistics()[sex][name]["percentiles"]
    return float(np.clip(mean + by, min(mean, low), max(mean, high)))


def volume(points: F64, triangles: I32) -> float:
    """Within a closed surface [m^3]."""
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def fitted(
    model: BodyModel, look: Look, height: float, weight: float, told: Mapping[str, float], differs: Mapping[str, float]
) -> Fitted:
    """The person like `look` of that height [m] and weight [kg]. told: measures that are known [m]; differs: by how many of their
    standard deviations others are meant to differ from what is expected."""
    sex = "male" if look.male > 0.5 else "female"
    adult = look.age >= ADULT
    goal: dict[str, tuple[float, float]] = {}
    if adult:
        goal = {
            n: (_differing(sex, n, mean, differs.get(n, 0.0) * left), left)
            for n, (mean, left) in expected(sex, height, weight).items()
        }
    goal |= {name: (value, _TOLD) for name, value in told.items()}
    goal |= {"stature": (height, _CLOSE_M), "weight": (weight, _CLOSE_KG)}
    names = [name for name in _ALL if name in goal]
    wanted, spread = (np.array([goal[name][k] for name in names]) for k in (0, 1))
    usual, width = _priors(look)
    low = np.array([0.0 if name in _NUMBERS else -1.0 for name in UNKNOWNS])
    column = [_ALL.index(name) for name in names]
    slope = model.slopes[sex][column].astype(np.float64)
    damping = 0.0

    def squares(x: F64, at: F64) -> float:
        return float(np.square((wanted - at) / spread).sum() + np.square((usual - x) / width).sum())

    best = usual
    at = measured(model, _with(look, best))[column]
    least = squares(best, at)
    for _ in range(_ROUNDS):
        x = _step(best, slope / spread[:, None], (wanted - at) / spread, usual, width, low, damping)
        moved = x - best
        if np.abs(moved).max() < 1e-3:
            break
        there = measured(model, _with(look, x))[column]
        slope = slope + np.outer(there - at - slope @ moved, moved) / float(moved @ moved)
        square = squares(x, there)
        if square < least:
            damping = 0.3 * damping
            best, at, least = x, there, square
        else:
            damping = max(4.0 * damping, 1.0)
    found = _with(look, best)
    points = model.points(found)
    points *= height / float(np.ptp(points[: model.body, 1]))
    return Fitted(found, model.stood(points), DENSITY * volume(points[: model.body], model.closed))


def _step(x: F64, slope: F64, residual: F64, usual: F64, width: F64, low: F64, damping: float) -> F64:
    """The damped step of Gauss and Newton from x, within low and 1; what reaches a bound stays there, and the rest makes up for
    it."""
    free = np.ones(len(x), np.bool_)
    new = x.copy()
    for _ in range(3):
        left = residual - slope[:, ~free] @ (new - x)[~free]
        j, w = slope[:, free], width[free]
        square = j.T @ j + np.diag((1.0 + damping) / w**2)
        new[free] = x[free] + np.linalg.solve(square, j.T @ left + (usual - x)[free] / w**2)
        out = free & ((new < low) | (new > 1.0))
        if not out.any():
            break
        new = np.clip(new, low, 1.0)
        free &= ~out
    return np.clip(new, low, 1.0)


def measured(model: BodyModel, look: Look) -> F64:
    """(M,) of a look: weight [kg], then the measures of `measures` [m]."""
    shape = model.shape(look)
    kilograms = DENSITY * volume(shape.points[: model.body], model.closed)
    return np.array([kilograms, *measures(model, shape).values()])


def _with(look: Look, x: F64) -> Look:
    """The look with its unknowns at these values, which are added to a face's own details."""
    value = dict(zip(UNKNOWNS, x.tolist(), strict=True))
    details = dict(look.details)
    for name in _DETAILS:
        details[name] = float(np.clip(details.get(name, 0.0) + value[name], -1.0, 1.0))
    return replace(look, details=details, **{name: value[name] for name in _NUMBERS})


def _priors(look: Look) -> tuple[F64, F64]:
    """Usual values and spreads of UNKNOWNS."""
    usual = [*(getattr(look, name) for name in _NUMBERS), *(0.0 for _ in _DETAILS)]
    return np.array(usual), np.array([*_NUMBERS.values(), *(SPREAD for _ in _DETAILS)])


def jacobian(model: BodyModel, sex: str) -> F64:
    """(M, U) of `measured` by UNKNOWNS for the average person of a sex, as the model's file keeps it."""
    look = Look(float(sex == "male"))
    x0 = _priors(look)[0]
    columns: list[F64] = []
    for k in range(len(UNKNOWNS)):
        by = 0.2 * (np.arange(len(UNKNOWNS)) == k)
        high, low = (measured(model, _with(look, x)) for x in (x0 + by, x0 - by))
        columns.append((high - low) / 0.4)
    return np.stack(columns, axis=1)

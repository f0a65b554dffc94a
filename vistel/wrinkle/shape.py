"""Characteristic wrinkle shapes: 2D curves with attributes at their control points (Singh §5.2.1, Figure 45).

A shape is normalised: its curves lie in [-1, 1] x [-1, 1], x right and y up, and its attributes are at most 1. An instance
(`vistel.wrinkle.instance`) gives it a place, a size, a thickness and an intensity.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from vistel.arrays import F64
from vistel.wrinkle.curve import crossing, sampled
from vistel.wrinkle.errors import Entry

Unit = Annotated[float, Field(ge=-1.0, le=1.0, allow_inf_nan=False)]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
End = Literal["round", "taper", "vanish"]

TOUCH = 0.02
"""Branches meet where they are no farther apart, in the shape's unit."""


class Point(Entry):
    """A control point: the curve passes through it."""

    at: tuple[Unit, Unit]
    intensity: Unit = 1.0
    """Height of the wrinkle here, in parts of the instance's."""
    thickness: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    """Radius here, in parts of the instance's."""


class Layer(Entry):
    """Part of the cross-section of a wrinkle: one offset density beside the curve.

    A ridge with a valley beside it is two layers, the valley's intensity being negative; a furrow in skin is a narrow
    negative one and a wide positive one.
    """

    intensity: Annotated[float, Field(ge=-2.0, le=2.0)] = 1.0
    offset: Annotated[float, Field(ge=-3.0, le=3.0)] = 0.0
    """To the left of the curve, in radii."""
    thickness: Annotated[float, Field(gt=0.0, le=3.0)] = 1.0
    """In radii."""
    lean: Annotated[float, Field(ge=-0.9, le=0.9)] = 0.0
    """Above 0: wide and gentle on the left of the curve, narrow and steep on its right."""


class Branch(Entry):
    """One curve of a shape. It may begin or end on another one."""

    points: Annotated[list[Point], Field(min_length=2, max_length=64)]
    start: End = "taper"
    end: End = "taper"
    """round: a half disc; taper: the augmented primitive (Singh Figure 48), `cap` long; vanish: intensity goes to 0."""
    cap: Annotated[float, Field(gt=0.0, le=10.0)] = 2.0
    """Length of tapering ends, in radii."""

    @model_validator(mode="after")
    def _is_a_curve(self) -> "Branch":
        at = self.places
        for k, length in enumerate(np.linalg.norm(np.diff(at, axis=0), axis=1)):
            if length < 1e-3:
                raise ValueError(f"control points {k} and {k + 1} are in one place")
        if (met := crossing(sampled(at, 8)[0])) is not None:
            raise ValueError(f"crosses itself at {_place(met)}")
        return self

    @property
    def places(self) -> F64:
        """(N, 2) of the control points."""
        return np.array([p.at for p in self.points])

    @property
    def intensities(self) -> F64:
        """(N,) at the control points, 0 where an end vanishes."""
        out = np.array([p.intensity for p in self.points])
        out[0] *= self.start != "vanish"
        out[-1] *= self.end != "vanish"
        return out

    @property
    def thicknesses(self) -> F64:
        """(N,) at the control points."""
        return np.array([p.thickness for p in self.points])


class WrinkleShape(Entry):
    """A characteristic shape. Raises WrinkleError (from `vistel.wrinkle.shape_file`) where its branches cross."""

    name: Name
    about: str = ""
    material: Literal["cloth", "skin"] = "cloth"
    profile: Annotated[tuple[Layer, ...], Field(min_length=1, max_length=8)] = (Layer(),)
    branches: Annotated[list[Branch], Field(min_length=1, max_length=64)]

    @model_validator(mode="after")
    def _branches_do_not_cross(self) -> "WrinkleShape":
        lopsided = any(layer.offset or layer.lean for layer in self.profile)
        lines = [sampled(b.places, 8)[0] for b in self.branches]
        for k, branch in enumerate(self.branches):
            if lopsided and "round" in (branch.start, branch.end):
                raise ValueError(f"branches[{k}]: an end that is round needs a profile without offset and lean; use taper")
            for other in range(k):
                met = crossing(lines[k], lines[other])
                if met is not None and not _meets(met, lines[k], lines[other]):
                    raise ValueError(f"branches[{other}] and branches[{k}] cross at {_place(met)}; let one begin there")
        return self


def _meets(point: F64, a: F64, b: F64) -> bool:
    """Whether one of two curves begins or ends where they come together."""
    ends = np.array((a[0], a[-1], b[0], b[-1]))
    return bool(np.linalg.norm(ends - point, axis=1).min() <= TOUCH)


def _place(point: F64) -> str:
    return f"({point[0]:.2f}, {point[1]:.2f})"


def normalised(branches: list[Branch], name: str, about: str = "", material: Literal["cloth", "skin"] = "cloth") -> WrinkleShape:
    """A shape of these branches, moved and scaled alike in x and y so that they fill [-1, 1] x [-1, 1], attributes scaled so that
    the largest is 1."""
    at = np.concatenate([b.places for b in branches])
    low, high = at.min(axis=0), at.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * float((high - low).max())
    half = half if half > 0.0 else 1.0
    strongest = max(abs(p.intensity) for b in branches for p in b.points) or 1.0
    thickest = max(p.thickness for b in branches for p in b.points)

    def moved(p: Point) -> Point:
        x, y = np.clip((np.array(p.at) - middle) / half, -1.0, 1.0).round(4).tolist()
        return Point(at=(x, y), intensity=round(p.intensity / strongest, 3), thickness=round(p.thickness / thickest, 3))

    out = [b.model_copy(update={"points": [moved(p) for p in b.points]}) for b in branches]
    return WrinkleShape(name=name, about=about, material=material, branches=out)

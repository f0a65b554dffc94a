"""The file that says which scan is which part of somebody, how the parts lie and where they are joined."""

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from vistel.arrays import F64
from vistel.figure.making.source import MakingError
from vistel.toml import file as toml

Triple = tuple[float, float, float]
Name = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_\-]*$")]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PartFile(_Model):
    """One scan. It is scaled by `unit`, then turned, then moved; or laid so that `landmarks` meet."""

    part: Name
    """What it is: "head", "left_forearm", ...; each once."""
    file: Path
    """Mesh: .obj, .ply, .glb, ...; relative to this file."""
    texture: Path | None = None
    """Picture of it, where the mesh names none."""
    turn: Triple = (0.0, 0.0, 0.0)
    """Degrees about X, then Y, then Z."""
    move: Triple = (0.0, 0.0, 0.0)
    """Metres."""
    landmarks: list[tuple[Triple, Triple]] = []
    """Pairs: a point of the scan in its own unit, and where it belongs [m]. Three or more that are not in one line."""
    scaled: bool = False
    """Whether landmarks may change its size too."""

    @model_validator(mode="after")
    def _one_way(self) -> "PartFile":
        if self.landmarks and (any(self.turn) or any(self.move)):
            raise ValueError("give landmarks, or turn and move, not both")
        if 0 < len(self.landmarks) < 3:
            raise ValueError(f"{len(self.landmarks)} landmarks, expected three or more")
        return self

    def placed(self, points: F64, unit: float) -> F64:
        """Points (V, 3) of the scan where they belong [m]. Raises MakingError for landmarks in one line."""
        if self.landmarks:
            here = np.array([h for h, _ in self.landmarks]) * unit
            there = np.array([t for _, t in self.landmarks])
            return _fitted(points * unit, here, there, self.scaled, self.part)
        x, y, z = np.radians(self.turn)
        turn = _about(2, z) @ _about(1, y) @ _about(0, x)
        return points * unit @ turn.T + np.array(self.move)


class Seam(_Model):
    """A joint of two parts whose settings differ from those found."""

    between: tuple[Name, Name]
    zone: float | None = Field(default=None, gt=0.0, le=0.5)
    """Half the length in which they pass into one another [m]."""


class Assembly(_Model):
    """The whole file."""

    name: str = ""
    unit: float = Field(default=1.0, gt=0.0, le=10.0)
    """Metres of one unit of the scans."""
    up: str = Field(default="Y", pattern="^[YZ]$")
    """Axis of the assembled person that is up."""
    height: float | None = Field(default=None, ge=0.5, le=2.6)
    """Of the person [m]; as assembled otherwise."""
    parts: list[PartFile] = Field(min_length=2, max_length=40)
    joints: list[Seam] = []
    """Joints are found wherever the open ends of two parts face each other; these settings replace what is found."""

    @model_validator(mode="after")
    def _known(self) -> "Assembly":
        names = [p.part for p in self.parts]
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise ValueError(f"parts: {', '.join(twice)} stands more than once")
        for i, seam in enumerate(self.joints):
            one, other = seam.between
            for name in (one, other):
                if name not in names:
                    raise ValueError(f"joints[{i}].between: there is no part {name!r}; the parts are {', '.join(names)}")
            if one == other:
                raise ValueError(f"joints[{i}].between: {one!r} twice")
        return self


def read_assembly(path: Path) -> Assembly:
    """Raises MakingError, one line per fault that says what is wrong and where."""
    source_file = toml.read(path, MakingError)
    assembly = source_file.checked(Assembly, MakingError)
    for i, part in enumerate(assembly.parts):
        for file in (part.file, part.texture):
            if file is not None and not (path.parent / file).is_file():
                raise MakingError(source_file.described([f"parts[{i}]: {part.part}: there is no file {file}"]))
    return assembly


def _about(axis: int, angle: float) -> F64:
    c, s = float(np.cos(angle)), float(np.sin(angle))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out = np.eye(3)
    out[i, i], out[i, j], out[j, i], out[j, j] = c, -s, s, c
    return out


def _fitted(points: F64, here: F64, there: F64, scaled: bool, name: str) -> F64:
    """Moved, turned and perhaps scaled so that landmarks meet with the least squares of distances (Umeyama 1991)."""
    a, b = here - here.mean(axis=0), there - there.mean(axis=0)
    if np.linalg.svd(a, compute_uv=False)[1] < 0.01 * np.linalg.norm(a):
        raise MakingError(f"part {name}: its landmarks lie in one line; give three that do not")
    u, d, vt = np.linalg.svd(b.T @ a)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    turn = (u * sign) @ vt
    scale = float((d * sign).sum() / np.square(a).sum()) if scaled else 1.0
    return scale * (points - here.mean(axis=0)) @ turn.T + there.mean(axis=0)

"""The rules of the face as checked data: `action_units.toml` beside this file, or another such file."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from vistel.arrays import F64
from vistel.audio.visemes import VISEMES
from vistel.figure.face.marks import MARK_COUNT, MARK_INDEX
from vistel.toml import file as toml

FILE = Path(__file__).with_name("action_units.toml")
SIDES = ("left", "right")

Finite = Annotated[float, Field(allow_inf_nan=False, ge=-90.0, le=90.0)]
Vector = tuple[Finite, Finite, Finite]


class FaceRuleError(ValueError):
    """A file of rules that cannot be used; a line per fault: file: key: what was expected."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SkinPull(_Table):
    """Skin round a mark moves."""

    at: str
    offset: Vector = (0.0, 0.0, 0.0)
    move: Vector
    radius: tuple[Annotated[float, Field(gt=0.0)], Annotated[float, Field(gt=0.0)], Annotated[float, Field(gt=0.0)]]
    lip: Literal["upper", "lower"] | None = None


class Unit(_Table):
    """An action unit as in its file; see the head of action_units.toml."""

    name: Annotated[str, Field(pattern=r"^[A-Z][A-Z0-9]{1,7}$")]
    title: str
    sides: bool = False
    marks: dict[str, tuple[Finite, Finite]] = {}
    pulls: Annotated[tuple[SkinPull, ...], Field(max_length=12)] = ()
    jaw: tuple[Finite, Finite] = (0.0, 0.0)
    lids: tuple[Annotated[float, Field(ge=-1.0, le=1.0)], Annotated[float, Field(ge=-1.0, le=1.0)]] = (0.0, 0.0)
    arkit: dict[str, Annotated[float, Field(ge=0.0, le=2.0)]] = {}
    most: Annotated[float, Field(gt=0.0, le=2.0)] = 1.0

    @model_validator(mode="after")
    def _marks_are_there(self) -> "Unit":
        for mark in (*self.marks, *(p.at for p in self.pulls)):
            if not any(name in MARK_INDEX for name in ((mark, f"left_{mark}") if self.sides else (mark,))):
                raise ValueError(f"there is no mark {mark!r}; there are {', '.join(MARK_INDEX)}")
        return self


class _File(_Table):
    units: Annotated[list[Unit], Field(min_length=1, max_length=100)]
    visemes: dict[str, dict[str, Annotated[float, Field(ge=0.0, le=1.0)]]] = {}


@dataclass(frozen=True, eq=False)
class OneSided:
    """A unit on one side, or a whole one: side 1 left, -1 right, 0 both.

    pattern: (13, 2) how it moves the marks at intensity 1 [m, a standard head].
    """

    name: str
    unit: Unit
    side: int
    pattern: F64

    def mark(self, name: str) -> int:
        """Index of a mark as the unit's file names it, on this side."""
        if self.side and f"left_{name}" in MARK_INDEX:
            return MARK_INDEX[f"{SIDES[self.side < 0]}_{name}"]
        return MARK_INDEX[name]

    @property
    def mirror(self) -> float:
        """Factor of x."""
        return -1.0 if self.side < 0 else 1.0


@dataclass(frozen=True, eq=False)
class FaceRules:
    """Every unit, those of two sides twice: left_AU12, right_AU12, AU26. visemes: (15, units) how strong each is in the shapes of
    a mouth that speaks, in the order of `VISEMES`."""

    units: tuple[OneSided, ...]
    visemes: F64

    @property
    def names(self) -> tuple[str, ...]:
        """In order."""
        return tuple(u.name for u in self.units)


def load_rules(path: Path) -> FaceRules:
    """Read and check a file. Raises FaceRuleError."""
    whole = toml.read(path, FaceRuleError)
    file = whole.checked(_File, FaceRuleError)
    names = [u.name for u in file.units]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise FaceRuleError(whole.described([f"units: {', '.join(twice)} twice; expected each once"]))
    if odd := sorted(set(file.visemes) - set(VISEMES)):
        raise FaceRuleError(whole.described([f"visemes: there is no viseme {', '.join(odd)}; there are {', '.join(VISEMES)}"]))
    if odd := sorted({u for shape in file.visemes.values() for u in shape} - set(names)):
        raise FaceRuleError(whole.described([f"visemes: there is no unit {', '.join(odd)}"]))
    units = tuple(_one(u, side) for u in file.units for side in ((1, -1) if u.sides else (0,)))
    shapes = [file.visemes.get(viseme, {}) for viseme in VISEMES]
    return FaceRules(units, np.array([[shape.get(u.unit.name, 0.0) for u in units] for shape in shapes]))


@cache
def builtin_rules() -> FaceRules:
    """The project's own."""
    return load_rules(FILE)


def _one(unit: Unit, side: int) -> OneSided:
    name = f"{SIDES[side < 0]}_{unit.name}" if side else unit.name
    made = OneSided(name, unit, side, np.zeros((MARK_COUNT, 2)))
    for mark, (x, y) in unit.marks.items():
        made.pattern[made.mark(mark)] = (1e-3 * made.mirror * x, 1e-3 * y)
    return made

"""Sets of wrinkles that figures wear, as readable files; those of the built-in figures lie in `sets/` beside this file."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from vistel.arrays import F64
from vistel.toml import file as toml
from vistel.wrinkle.drive import Drive, Finite
from vistel.wrinkle.errors import Entry, WrinkleError
from vistel.wrinkle.region import Region, builtin_regions
from vistel.wrinkle.shape import Name, WrinkleShape
from vistel.wrinkle.shape_file import shape_of
from vistel.wrinkle.sheet import WrinkleEntry, instances

FOLDER = Path(__file__).with_name("sets")
MOST_WRINKLES = 1000
"""Most wrinkles in all sets of a file."""


class SetEntry(Entry):
    """Wrinkles of a region that come and go together."""

    name: Name
    region: str
    material: Literal["cloth", "skin"] = "cloth"
    drive: Drive
    wrinkles: Annotated[tuple[WrinkleEntry, ...], Field(max_length=200)] = ()
    pull: Annotated[tuple[tuple[Finite, Annotated[float, Field(ge=-0.2, le=0.2)]], ...], Field(max_length=32)] = ()
    """How far the cloth moves along the region [m] at a v, values of v rising; above 0 to higher v."""
    lift: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0
    """Share of the displacement that moves the mesh; 0 for fine wrinkles of skin, which are only seen."""
    memory: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Share of the wrinkles that stays for a while when what drives them is gone."""

    mouth: bool = False
    """What is seen between the lips, where they are painted on closed skin."""

    @model_validator(mode="after")
    def _is_complete(self) -> "SetEntry":
        if not self.wrinkles and not self.pull and not self.mouth:
            raise ValueError("has neither wrinkles nor pull")
        at = [v for v, _ in self.pull]
        if any(b <= a for a, b in pairwise(at)):
            raise ValueError("pull: expected values of v that rise")
        return self

    def pulled(self, v: F64) -> F64:
        """Motion [m] of the cloth at v; 0 beyond the given values."""
        if not self.pull:
            return np.zeros_like(v)
        at, by = zip(*self.pull, strict=True)
        return np.interp(v, at, by, left=0.0, right=0.0)


class SetsFile(Entry):
    """A file of sets. shapes: those of its own, beside the built-in ones and those in files of their own."""

    shapes: Annotated[tuple[WrinkleShape, ...], Field(max_length=64)] = ()
    sets: Annotated[list[SetEntry], Field(min_length=1, max_length=64)]


@dataclass(frozen=True, eq=False)
class WrinkleSet:
    """A set, its region, the shapes that its wrinkles name, and what it is from."""

    entry: SetEntry
    region: Region
    shapes: Mapping[str, WrinkleShape]
    source: Path | str

    def shape(self, name: str) -> WrinkleShape:
        """One that its wrinkles name."""
        return self.shapes[name]


def load_sets(path: Path) -> list[WrinkleSet]:
    """Read and check a file of sets. Raises WrinkleError, one line per fault."""
    return sets_of(toml.read(path, WrinkleError), lambda name: shape_of(name, path.parent))


def sets_in(text: str, source: str) -> list[WrinkleSet]:
    """The sets of a text such as `sets_text` writes: shapes are built in or in the text itself, since the text may come from
    another site. Raises WrinkleError, one line per fault, which begins with `source`."""
    return sets_of(toml.parsed(text, source, WrinkleError), _builtin)


def sets_of(told: toml.TomlFile, look: Callable[[str], WrinkleShape]) -> list[WrinkleSet]:
    """The sets of a file's tables; look: finds a shape that is not in it. Raises WrinkleError, one line per fault."""
    known, source = builtin_regions(), told.source
    file = told.checked(SetsFile, WrinkleError)
    own = {shape.name: shape for shape in file.shapes}
    found: dict[str, WrinkleShape] = {}

    def shape(name: str) -> WrinkleShape:
        if name not in found:
            found[name] = own[name] if name in own else look(name)
        return found[name]

    if (wrinkles := sum(len(entry.wrinkles) for entry in file.sets)) > MOST_WRINKLES:
        raise WrinkleError(f"{source}: {wrinkles} wrinkles, expected at most {MOST_WRINKLES}")
    out: list[WrinkleSet] = []
    for k, entry in enumerate(file.sets):
        if entry.region not in known:
            raise WrinkleError(told.described([f"sets[{k}].region: is {entry.region!r}, expected one of {', '.join(known)}"]))
        # A plane of the usual size: what leaves it here leaves it on everybody.
        instances(entry.wrinkles, (1.0, 1.0), source, shape, wraps=True, scale=1e-6)
        out.append(WrinkleSet(entry, known[entry.region], {w.shape: shape(w.shape) for w in entry.wrinkles}, source))
    return out


def charted(sets: Sequence[WrinkleSet]) -> list[str]:
    """Regions of sets that need a texture of their own, for `vistel.wrinkle.dressing.dressed`."""
    return sorted({each.region.name for each in sets if each.region.charted})


def wrinkle_sets(names: Sequence[str | Path] = ("shirt", "trousers", "face", "hands")) -> list[WrinkleSet]:
    """Sets of several files: names of built-in ones, or paths. Raises WrinkleError."""
    out: list[WrinkleSet] = []
    for name in names:
        path = Path(name)
        if path.suffix != ".toml":
            path = FOLDER / f"{name}.toml"
            if not path.is_file():
                there = ", ".join(sorted(p.stem for p in FOLDER.glob("*.toml")))
                raise WrinkleError(f"no wrinkles called {str(name)!r}; there are {there}, or a file that ends in .toml")
        out += load_sets(path)
    return out


def _builtin(name: str) -> WrinkleShape:
    if name.endswith(".toml"):
        raise WrinkleError(f"is {name!r}: no files here; expected a built-in shape or one of shapes")
    return shape_of(name)

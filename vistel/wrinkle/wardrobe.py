"""Sets of wrinkles that figures wear, as readable files; those of the built-in figures lie in `sets/` beside this file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from vistel.wrinkle.drive import Drive, Finite
from vistel.wrinkle.errors import Entry, WrinkleError, checked, read_toml
from vistel.wrinkle.region import Region, builtin_regions
from vistel.wrinkle.shape import Name
from vistel.wrinkle.sheet import WrinkleEntry, instances

F64 = NDArray[np.float64]

FOLDER = Path(__file__).with_name("sets")


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
    def _is_complete(self) -> SetEntry:
        if not self.wrinkles and not self.pull and not self.mouth:
            raise ValueError("has neither wrinkles nor pull")
        at = [v for v, _ in self.pull]
        if any(b <= a for a, b in pairwise(at)):
            raise ValueError("pull: expected values of v that rise")
        return self

    def pulled(self, v: F64) -> F64:
        """Motion [m] of the cloth at v; 0 beyond what is said."""
        if not self.pull:
            return np.zeros_like(v)
        at, by = zip(*self.pull, strict=True)
        return np.interp(v, at, by, left=0.0, right=0.0)


class _File(Entry):
    sets: Annotated[list[SetEntry], Field(min_length=1, max_length=64)]


@dataclass(frozen=True)
class WrinkleSet:
    """A set, its region and the file it is from."""

    entry: SetEntry
    region: Region
    source: Path


def load_sets(path: Path) -> list[WrinkleSet]:
    """Read and check a file of sets. Raises WrinkleError, one line per fault."""
    known = builtin_regions()
    out: list[WrinkleSet] = []
    for k, entry in enumerate(checked(_File, read_toml(path), path).sets):
        if entry.region not in known:
            raise WrinkleError(f"{path}: sets[{k}].region: is {entry.region!r}, expected one of {', '.join(known)}")
        # A plane of the usual size: off its edges here is off them on everybody.
        instances(entry.wrinkles, (1.0, 1.0), path, wraps=True, scale=1e-6)
        out.append(WrinkleSet(entry, known[entry.region], path))
    return out


def wardrobe(names: Sequence[str | Path] = ("shirt", "trousers", "face", "hands")) -> list[WrinkleSet]:
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

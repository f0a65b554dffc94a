"""Sheets: wrinkles on a flat piece of cloth or skin, as a readable file."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from vistel.arrays import F64
from vistel.toml import file as toml
from vistel.wrinkle.curve import sampled
from vistel.wrinkle.errors import Entry, WrinkleError
from vistel.wrinkle.instance import Instance
from vistel.wrinkle.shape import WrinkleShape
from vistel.wrinkle.shape_file import shape_of

Metres = Annotated[float, Field(gt=0.0, le=10.0)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class WrinkleEntry(Entry):
    """One wrinkle: an instance of a characteristic shape."""

    shape: str
    """Name of a built-in shape, or a file of one (.toml), relative to this one."""
    at: tuple[Finite, Finite]
    """Where the middle of the shape is, in parts of the plane's width and height; the origin is bottom left."""
    size: Metres | tuple[Metres, Metres]
    """From the middle of the shape to its edge [m]; or across and along."""
    thickness: Metres
    """[m]"""
    intensity: Annotated[float, Field(ge=-1.0, le=1.0)]
    """Height [m]; below 0: a valley."""
    turn: Finite = 0.0
    """Degrees, counter-clockwise."""
    mirrored: bool = False
    wrinkledness: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    seed: int = 0

    def instance(self, plane: tuple[float, float], shape: WrinkleShape, scale: float = 1.0) -> Instance:
        """The wrinkle, of `shape`, on a plane (width, height) [m], lengths times `scale`."""
        across, along = self.size if isinstance(self.size, tuple) else (self.size, self.size)
        return Instance(
            shape,
            (self.at[0] * plane[0], self.at[1] * plane[1]),
            (scale * across, scale * along),
            scale * self.thickness,
            scale * self.intensity,
            math.radians(self.turn),
            self.mirrored,
            self.wrinkledness,
            self.seed,
        )


class Sheet(Entry):
    """A plane and its wrinkles."""

    size: tuple[Metres, Metres]
    """Width and height of the plane [m]."""
    wraps: bool = False
    """Whether its left and right edges are one line, as on a sleeve."""
    texture: Path | None = None
    """Picture of it without wrinkles, relative to this file."""
    wrinkles: Annotated[list[WrinkleEntry], Field(min_length=1, max_length=2000)]


def load_sheet(path: Path) -> tuple[Sheet, list[Instance]]:
    """Read and check a sheet. Raises WrinkleError, one line per fault."""
    sheet = toml.read(path, WrinkleError).checked(Sheet, WrinkleError)
    if sheet.texture is not None:
        sheet = sheet.model_copy(update={"texture": path.parent / sheet.texture})
    return sheet, instances(sheet.wrinkles, sheet.size, path, lambda name: shape_of(name, path.parent), wraps=sheet.wraps)


def instances(
    wrinkles: Sequence[WrinkleEntry],
    plane: tuple[float, float],
    source: Path | str,
    shape: Callable[[str], WrinkleShape],
    *,
    wraps: bool,
    scale: float = 1.0,
) -> list[Instance]:
    """The wrinkles of a file on a plane (width, height) [m]; shape: by its name. Raises WrinkleError for what is not in the
    taxonomy or lies off the plane."""
    out: list[Instance] = []
    faults: list[str] = []
    for k, entry in enumerate(wrinkles):
        try:
            made = entry.instance(plane, shape(entry.shape), scale)
        except WrinkleError as fault:
            faults.append(f"{source}: wrinkles[{k}].shape: {fault}")
            continue
        off = _off(made, plane, wraps)
        if off is not None:
            faults.append(
                f"{source}: wrinkles[{k}]: leaves the texture at {off[0]:.3f}, {off[1]:.3f} of its width and height; "
                "move it or make it smaller"
            )
        out.append(made)
    if faults:
        raise WrinkleError("\n".join(faults))
    return out


def _off(wrinkle: Instance, plane: tuple[float, float], wraps: bool) -> F64 | None:
    """The first place, in parts of the plane, where a curve leaves it; half round where it wraps."""
    low, high = ((-0.5, 0.0), (1.5, 1.0)) if wraps else ((0.0, 0.0), (1.0, 1.0))
    for points in wrinkle.control_points():
        at = sampled(points, 4)[0] / np.array(plane)
        out = ((at < low) | (at > high)).any(axis=1)
        if out.any():
            return at[np.argmax(out)]
    return None

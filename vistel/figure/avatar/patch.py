"""Patches: surface properties of parts of an avatar's texture besides colour, as in UsdPreviewSurface and glTF."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from vistel.arrays import F64, U8

MOST_PATCHES = 64
WHOLE = (0.0, 0.0, 1.0, 1.0)
_PICTURES = ("finish", "normal", "glow_picture", "opacity")
MATT = 0.5
"""Plain surfaces at least as rough have no highlight that is seen from far."""
_LEFT = "patch{}."
_FIRST_NUMBERS = 12
"""Of `Patch.numbers`, which all files have."""
_LATER_FLAGS = ("rigid", "strands")


@dataclass(frozen=True, eq=False)
class Patch:
    """A rectangle of an avatar's texture whose surface its file describes; its pictures span the rectangle, first row at the top.

    box: lowest u and v, highest u and v. roughness, metallic: 0 to 1, where there is no `finish`. finish: (H, W, 3) occlusion,
    roughness, metallic as 0 to 255. normal: (H, W, 3) in the tangent frame, red along u, green along v (up), 128 for none. glow:
    linear light that it emits, times `glow_picture` (H, W, 3) sRGB where there is one. opacity: (H, W), 255 opaque; below `cutoff`
    (0 to 1) nothing is drawn. blend: values between are half transparent. both_sides: it is drawn from behind too. rigid: what has
    it keeps its shape, whatever the skin beneath does: glasses. strands: it is of strands along v, which mirror as hair does."""

    box: tuple[float, float, float, float] = WHOLE
    roughness: float = 0.5
    metallic: float = 0.0
    finish: U8 | None = None
    normal: U8 | None = None
    glow: tuple[float, float, float] = (0.0, 0.0, 0.0)
    glow_picture: U8 | None = None
    opacity: U8 | None = None
    cutoff: float = 0.5
    blend: bool = False
    both_sides: bool = False
    rigid: bool = False
    strands: bool = False

    @property
    def pictures(self) -> dict[str, U8]:
        """Its pictures, by the names of their fields."""
        return {name: picture for name in _PICTURES if (picture := getattr(self, name)) is not None}

    @property
    def relief(self) -> bool:
        """Whether it only says how rough and uneven something opaque is that neither mirrors nor shines, which is seen near by."""
        if self.opacity is not None or self.blend or any(self.glow):
            return False
        if self.finish is not None:
            return self.normal is not None and not self.finish[..., 2].any()
        return not self.metallic and (self.normal is not None or self.roughness >= MATT)

    @property
    def sheet(self) -> bool:
        """Whether it has holes or two sides that differ from what is about it: what has it need not be the outside of something
        solid. Matt cloth that is seen from within, too, is taken for that."""
        return self.opacity is not None or (self.both_sides and not self.relief)

    @cached_property
    def film(self) -> bool:
        """Whether it is nowhere solid, as glass is: what lies behind is seen through it, and it shows what it mirrors."""
        return self.blend and self.opacity is not None and int(self.opacity.max(initial=0)) < 255.0 * self.cutoff

    @property
    def matt(self) -> bool:
        """Whether it neither mirrors nor shines: from far its light differs little from pixel to pixel."""
        return self.roughness >= MATT and not self.metallic and self.finish is None and not any(self.glow) and not self.blend

    @property
    def numbers(self) -> tuple[float, ...]:
        """All of it but pictures, as files keep it."""
        flags = float(self.blend), float(self.both_sides), float(self.rigid), float(self.strands)
        return (*self.box, self.roughness, self.metallic, *self.glow, self.cutoff, *flags)

    @property
    def key(self) -> tuple[Any, ...]:
        """A key that is equal for patches that look the same, wherever they are."""
        shown: dict[str, object] = dict(self.pictures)
        names = [f.name for f in fields(self) if f.name != "box"]
        return tuple(id(shown[name]) if name in shown else getattr(self, name) for name in names)

    def within(self, box: F64) -> "Patch":
        """The patch on a larger texture that contains its texture; box: left, bottom, width, height of that part."""
        low, high = box[:2] + np.array(self.box[:2]) * box[2:], box[:2] + np.array(self.box[2:]) * box[2:]
        return replace(self, box=(float(low[0]), float(low[1]), float(high[0]), float(high[1])))

    def evenly(self) -> "Patch":
        """The same without pictures: opaque, with mean roughness and metallic."""
        finish = None if self.finish is None else self.finish.reshape(-1, 3).mean(axis=0) / 255.0
        rough, metal = (self.roughness, self.metallic) if finish is None else (float(finish[1]), float(finish[2]))
        glow = (0.0, 0.0, 0.0) if self.glow_picture is not None else self.glow
        return Patch(self.box, rough, metal, glow=glow, both_sides=self.both_sides, rigid=self.rigid)

    def reduced(self, largest: int) -> "Patch":
        """With pictures of at most `largest` texels along a side."""
        return replace(self, **{name: _reduced(picture, largest) for name, picture in self.pictures.items()})  # type: ignore[arg-type]


def patch_of(patches: tuple[Patch, ...], uv: NDArray[np.floating], corner_triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    """(F,) patch on which the middle of each triangle lies, -1 for none."""
    middle = uv[corner_triangles].mean(axis=1)
    out = np.full(len(middle), -1, np.int32)
    for k, patch in enumerate(patches):
        out[((middle >= patch.box[:2]) & (middle <= patch.box[2:])).all(axis=1)] = k
    return out


def of_numbers(numbers: Sequence[float], pictures: Mapping[str, U8]) -> Patch:
    """The patch that had these `Patch.numbers` and pictures; older files do not have the last flags. Raises ValueError."""
    if not _FIRST_NUMBERS <= len(numbers) <= _FIRST_NUMBERS + len(_LATER_FLAGS):
        raise ValueError(f"{len(numbers)} numbers, expected {_FIRST_NUMBERS + len(_LATER_FLAGS)}")
    u, v, right, top, rough, metal, r, g, b, cutoff, blend, both, *later = numbers
    shown: dict[str, Any] = dict(pictures) | {name: value > 0.5 for name, value in zip(_LATER_FLAGS, later, strict=False)}
    return Patch((u, v, right, top), rough, metal, glow=(r, g, b), cutoff=cutoff, blend=blend > 0.5, both_sides=both > 0.5, **shown)


def to_arrays(patches: tuple[Patch, ...], *, small: bool = False) -> dict[str, Any]:
    """As named arrays, pictures encoded as PNG, or as JPEG where small differences are allowed."""
    out: dict[str, Any] = {}
    for k, p in enumerate(patches):
        at = _LEFT.format(k)
        out[f"{at}numbers"] = np.array(p.numbers, np.float64)
        for name, picture in p.pictures.items():
            out[f"{at}{name}"] = np.frombuffer(_encoded(picture, small and name != "opacity"), np.uint8)
    return out


def from_arrays(file: Mapping[str, Any], most_texels: int) -> tuple[Patch, ...]:
    """What `to_arrays` gave. Raises ValueError for what is damaged or larger."""
    out: list[Patch] = []
    while len(out) <= MOST_PATCHES and (at := _LEFT.format(len(out))) + "numbers" in file:
        pictures = {k: _decoded(bytes(file[at + k]), most_texels, k) for k in _PICTURES if at + k in file}
        try:
            out.append(of_numbers(np.asarray(file[f"{at}numbers"], np.float64).tolist(), pictures))
        except (ValueError, TypeError) as fault:
            raise ValueError(f"patch {len(out)}: {fault}") from fault
    return tuple(out)


def fault_of(patches: tuple[Patch, ...], most_texels: int) -> str:
    """What is wrong with them, empty for nothing."""
    if len(patches) > MOST_PATCHES:
        return f"{len(patches)} patches of its texture, expected at most {MOST_PATCHES}"
    for k, p in enumerate(patches):
        numbers = np.array((*p.box, p.roughness, p.metallic, *p.glow, p.cutoff))
        if not np.isfinite(numbers).all() or np.abs(numbers).max() > 1e4 or p.box[0] >= p.box[2] or p.box[1] >= p.box[3]:
            return f"patch {k} of its texture: numbers that are none, or lie nowhere"
        for name, picture in p.pictures.items():
            columns = 2 if name == "opacity" else 3
            if picture.dtype != np.uint8 or picture.ndim != columns or not 0 < max(picture.shape) <= most_texels:
                return f"patch {k} of its texture: {name} of {picture.shape}, expected at most {most_texels} texels"
    return ""


def _reduced(picture: U8, largest: int) -> U8:
    if max(picture.shape[:2]) <= largest:
        return picture
    image = Image.fromarray(picture)
    image.thumbnail((largest, largest), Image.Resampling.BOX)
    return np.asarray(image, np.uint8)


def _encoded(picture: U8, small: bool) -> bytes:
    stream = io.BytesIO()
    if small:
        Image.fromarray(picture).save(stream, "JPEG", quality=90, subsampling=0)
    else:
        Image.fromarray(picture).save(stream, "PNG")
    return stream.getvalue()


def _decoded(data: bytes, most_texels: int, name: str) -> U8:
    try:
        with Image.open(io.BytesIO(data), formats=("PNG", "JPEG")) as image:
            if max(image.size) > most_texels:
                raise ValueError(f"{name} of {image.size} texels, expected at most {most_texels}")
            return np.asarray(image.convert("L" if name == "opacity" else "RGB"), np.uint8)
    except (OSError, SyntaxError, Image.DecompressionBombError) as fault:
        raise ValueError(f"{name} that cannot be read ({fault})") from fault

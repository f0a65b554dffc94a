"""Texture coordinates and the one picture of an avatar, from the file's materials; plain clothes where it has none."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32, U8
from vistel.figure.avatar.atlas import atlas
from vistel.figure.avatar.patch import Patch
from vistel.figure.making.maps import CLAMP, MIRROR, scaled, tiled
from vistel.figure.making.pictures import LARGEST
from vistel.figure.making.source import SourceMaterial, SourceMesh
from vistel.figure.skeleton import FINGERS, JOINTS

_SWATCH = 32
_SQUARES = 4
"""Squares of a repeated picture laid side by side, at most."""
_HARDLY = 0.02
"""Share of a square by which a face must reach into it."""
_IRIS = 0.50
"""Radius of the iris, as a share of the eyeball's."""
_PUPIL = 0.20
"""Radius of the pupil, as a share of the eyeball's."""
_PLAIN = {  # sRGB
    "skin": (214, 168, 138),
    "top": (86, 104, 128),
    "trousers": (58, 62, 74),
    "shoes": (44, 38, 36),
}


@dataclass(frozen=True)
class TexturedMesh:
    """corner_uv: (F, 3, 2) texture coordinates of each face's corners in the one picture `albedo` (H, W, 3); patches: what parts
    of that are like beside their colour."""

    corner_uv: F64
    albedo: U8
    patches: tuple[Patch, ...]
    notes: tuple[str, ...]


def dress(source: SourceMesh, bone: I32, eye: NDArray[Any], height_of: F64, height: float) -> TexturedMesh:
    """source: with points in the upright frame; bone: (V,) joint each vertex follows most; eye: (F,) faces of eyeballs;
    height_of: (V,) above the soles [m]."""
    notes: list[str] = []
    pictures: list[U8] = []
    looks: list[Patch | None] = []
    of_picture: dict[tuple[Any, ...], int] = {}
    swatch: dict[tuple[Any, ...], int] = {}

    def shown(picture: U8, patch: Patch | None) -> int:
        pictures.append(picture)
        looks.append(patch)
        return len(pictures) - 1

    def plain(colour: tuple[int, int, int], patch: Patch | None) -> int:
        key = colour, None if patch is None else patch.key
        if key not in swatch:
            swatch[key] = shown(np.full((_SWATCH, _SWATCH, 3), colour, np.uint8), patch)
        return swatch[key]

    has_uv: Any = (source.uv_triangles >= 0).all(axis=1)
    slot = np.empty(len(source.triangles), np.int64)
    flat, eye_painted = np.ones(len(source.triangles), np.bool_), np.zeros(len(source.triangles), np.bool_)
    raw = np.full((len(source.triangles), 3, 2), 0.5)
    numbers: list[int] = np.unique(source.material).tolist()
    for m in numbers:
        rows = np.flatnonzero(source.material == m)
        material = source.materials[m]
        if material.picture is not None and has_uv[rows].any():
            # Materials that show one picture and are alike share it.
            textured = rows[has_uv[rows]]
            at, low, high = placed(source.uv[source.uv_triangles[textured]], material.wrap)
            key = id(material.picture), None if material.patch is None else material.patch.key, low, high, material.wrap
            if key not in of_picture:
                of_picture[key] = shown(*_over(material, low, high))
            raw[textured] = (at - low) / (np.array(high) - low)
            slot[rows] = of_picture[key]
            flat[rows] = ~has_uv[rows]
            continue
        if material.picture is not None:
            notes.append(f"material {material.name!r} has a picture, its faces no texture coordinates: plain colours")
        if material.colour is not None and material.colour != (255, 255, 255):
            slot[rows] = plain(material.colour, material.patch)
            continue
        part: Any = _part_of(source.triangles[rows], bone, height_of, height)
        for name in sorted(set(part[~eye[rows]].tolist())):
            slot[rows[np.asarray(part == name) & ~eye[rows]]] = plain(_PLAIN[str(name)], material.patch)
        painted = rows[eye[rows]]
        if len(painted):
            slot[painted], eye_painted[painted] = shown(_painted_eye(), None), True
    if flat[~eye].all():
        notes.append("no texture: plain clothes and skin by the parts of the body (--texture FILE gives the mesh one)")
    albedo, where = atlas(pictures)
    uv = np.where(flat[:, None, None], 0.5, np.clip(raw, 0.0, 1.0))
    if eye_painted.any():
        uv[eye_painted] = _seen_from_front(source.points, source.triangles[eye_painted])
    box = where[slot]
    patches = tuple(look.within(where[k]) for k, look in enumerate(looks) if look is not None)
    return TexturedMesh(box[:, None, :2] + uv * box[:, None, 2:], albedo, patches, tuple(notes))


def placed(uv: F64, wrap: tuple[str, str]) -> tuple[F64, tuple[int, int], tuple[int, int]]:
    """Coordinates of faces (N, 3, 2), each face moved as a whole to where its middle is in the picture, as far as its wrap
    allows; and the lowest and highest whole squares that they then lie on, at most _SQUARES each way."""
    out, low, high = uv.copy(), [0, 0], [1, 1]
    for k, how in enumerate(wrap):
        if how == CLAMP:
            continue
        turn = 2.0 if how == MIRROR else 1.0
        out[..., k] -= turn * np.floor((out[..., k].mean(axis=1, keepdims=True) - 1e-9) / turn)
        # Squares that faces hardly reach into are not worth their texels.
        low[k] = int(np.clip(np.floor(out[..., k].min() + _HARDLY), -_SQUARES // 2, 0))
        high[k] = int(np.clip(np.ceil(out[..., k].max() - _HARDLY), 1, low[k] + _SQUARES))
    return out, (low[0], low[1]), (high[0], high[1])


def _over(material: SourceMaterial, low: tuple[int, int], high: tuple[int, int]) -> tuple[U8, Patch | None]:
    """A material's picture and patch over these squares of its coordinates."""
    assert material.picture is not None
    if (low, high) == ((0, 0), (1, 1)):
        return material.picture, material.patch

    def over(picture: U8) -> U8:
        out = tiled(picture, low, high, material.wrap)
        step = -(-max(out.shape[:2]) // LARGEST)
        return out if step == 1 else scaled(out, (max(1, out.shape[0] // step), max(1, out.shape[1] // step)))

    patch = material.patch
    if patch is not None:
        patch = replace(patch, **{name: over(picture) for name, picture in patch.pictures.items()})  # type: ignore[arg-type]
    return over(material.picture), patch


def _painted_eye() -> U8:
    """An eyeball seen from the front: (128, 128, 3)."""
    y, x = np.mgrid[-1.0:1.0:128j, -1.0:1.0:128j]
    r = np.hypot(x, y)[..., None]
    angle = np.arctan2(y, x)[..., None]
    sclera = np.array((236.0, 232.0, 228.0)) - np.clip(r - 0.6, 0, 1) * (20.0, 60.0, 60.0)
    iris = np.array((104.0, 74.0, 46.0)) * (0.75 + 0.6 * np.clip(r / _IRIS, 0, 1) + 0.10 * np.cos(23.0 * angle))
    rim = np.clip((_IRIS - r) / 0.05, 0.0, 1.0)
    out = sclera * (1 - np.clip((_IRIS + 0.02 - r) / 0.04, 0, 1)) + iris * rim * np.clip((_IRIS + 0.02 - r) / 0.04, 0, 1)
    out = out * np.clip((r - _PUPIL) / 0.03, 0.0, 1.0) + 12.0 * (1 - np.clip((r - _PUPIL) / 0.03, 0.0, 1.0))
    return np.clip(out, 0, 255).astype(np.uint8)


def _seen_from_front(points: F64, triangles: I32) -> F64:
    """(F, 3, 2) where corners of eyeballs are in their front view; what faces back is at its edge."""
    out = np.empty((len(triangles), 3, 2))
    side = points[triangles[:, 0], 0] > 0.0
    for mine in (side, ~side):
        if not mine.any():
            continue
        p = points[triangles[mine]]
        low, high = p.reshape(-1, 3).min(axis=0), p.reshape(-1, 3).max(axis=0)
        d = (p - 0.5 * (low + high)) / (0.5 * np.max(high - low))
        r = np.linalg.norm(d[..., :2], axis=-1, keepdims=True)
        flat = d[..., :2] / np.maximum(r, 1e-9) * np.where(d[..., 2:] >= 0.0, np.minimum(r, 0.97), 0.97)
        out[mine] = 0.5 + 0.5 * flat
    return out


def _part_of(triangles: I32, bone: I32, height_of: F64, height: float) -> NDArray[np.str_]:
    """(N,) "skin", "top", "trousers" or "shoes" of faces."""
    name_of = np.array([_wear(JOINTS[b]) if b < len(JOINTS) else "top" for b in range(len(JOINTS) + 8)])
    part = name_of[bone[triangles[:, 0]]]
    low = height_of[triangles].mean(axis=1) < 0.055 * height
    part[(part == "trousers") & low] = "shoes"
    return part


def _wear(joint: str) -> str:
    if joint in ("neck", "head", "jaw", "left_eye", "right_eye") or joint.endswith("_hand"):
        return "skin"
    if any(finger in joint for finger in FINGERS):
        return "skin"
    if joint.endswith(("foot", "toes")):
        return "shoes"
    return "trousers" if joint.endswith("leg") or joint == "hips" else "top"


def drawn(corner_uv: F64, triangles: I32) -> tuple[I32, NDArray[np.float32], I32]:
    """Corner vertex (R,), uv (R, 2) and triangles (F, 3) of drawn vertices: one for each vertex and texture place."""
    rounded = np.round(corner_uv.reshape(-1, 2) * 1048576.0).astype(np.int64)
    key = np.column_stack([triangles.reshape(-1).astype(np.int64), rounded])
    _, first, index = np.unique(key, axis=0, return_index=True, return_inverse=True)
    vertex = triangles.reshape(-1)[first].astype(np.int32)
    uv = corner_uv.reshape(-1, 2)[first].astype(np.float32)
    return vertex, uv, index.reshape(-1, 3).astype(np.int32)

"""Materials of glTF: colour, and what a surface is like beside it, each picture laid as that of the colour."""

from dataclasses import replace
from typing import Any

import numpy as np

from vistel.arrays import U8
from vistel.colour import srgb
from vistel.figure.avatar.patch import Patch
from vistel.figure.making.files.gltf import Document, as_object
from vistel.figure.making.maps import CLAMP, MIRROR, REPEAT, Lying, laid, occluded, scaled, steeper, times, tinted, together
from vistel.figure.making.pictures import LARGEST, alpha_of, decoded
from vistel.figure.making.source import Finish, MakingError, SourceMaterial

_WRAPS = {33071: CLAMP, 33648: MIRROR}
_PLAIN = 64
"""Texels along a side of the colour of a material that has other pictures only."""


class GltfMaterials:
    """Reads them. patches: read other surface properties too; notes: receives remarks."""

    def __init__(self, document: Document, notes: list[str], *, patches: bool) -> None:
        self._document, self._notes, self._patches = document, notes, patches
        self._pictures: dict[int, U8 | None] = {}

    def material(self, row: dict[str, Any]) -> SourceMaterial:
        """One entry of the file's `materials`. Raises MakingError."""
        name = str(row.get("name", ""))
        colour = row.get("pbrMetallicRoughness", {}).get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        factor = np.clip(np.array(colour[:3], np.float64), 0.0, 1.0)
        r, g, b = np.round(255.0 * srgb(factor)).astype(int).tolist()
        info = colour_texture(row)
        picture = None
        if "index" in info:
            picture = self._picture(info, name)
            if picture is not None and (factor < 1.0).any():
                picture = tinted(picture, factor)
        out = SourceMaterial(name, (r, g, b), picture, self._finish(row))
        if not self._patches:
            return out
        patch = self._patch(row, name, float(colour[3]) if len(colour) > 3 else 1.0)
        if patch is not None and patch.pictures and picture is None:
            out = replace(out, picture=np.full((_PLAIN, _PLAIN, 3), (r, g, b), np.uint8))
        return replace(out, patch=patch, wrap=self.lying(layout(row)).wrap)

    def lying(self, info: dict[str, Any]) -> Lying:
        """How a texture lies, of its set of coordinates, their origin bottom left."""
        moved = info.get("extensions", {}).get("KHR_texture_transform", {})
        (x, y), (sx, sy), turn = moved.get("offset", (0, 0)), moved.get("scale", (1, 1)), float(moved.get("rotation", 0))
        c, s = np.cos(turn), np.sin(turn)
        matrix = np.array([[c * sx, s * sy, x], [-s * sx, c * sy, y], [0.0, 0.0, 1.0]])
        over = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])
        wrap = (REPEAT, REPEAT)
        if "index" in info and "sampler" in (texture := self._document.row("textures", info["index"])):
            sampler = self._document.row("samplers", texture["sampler"])
            wrap = _WRAPS.get(sampler.get("wrapS", 0), REPEAT), _WRAPS.get(sampler.get("wrapT", 0), REPEAT)
        return Lying(f"TEXCOORD_{moved.get('texCoord', info.get('texCoord', 0))}", over @ matrix @ over, wrap)

    def alpha(self, row: dict[str, Any]) -> U8 | None:
        """(H, W) opacity of the picture of a material's colour; None where it is solid, or the material says so."""
        data = self._picture_data(colour_texture(row)) if row.get("alphaMode", "OPAQUE") != "OPAQUE" else None
        return None if data is None else alpha_of(data)

    def _patch(self, row: dict[str, Any], name: str, solid: float) -> Patch | None:
        """None for a material with nothing but a colour."""
        told, like = row.get("pbrMetallicRoughness"), self.lying(layout(row))
        lit = not {"KHR_materials_unlit", "VRMC_materials_mtoon"} & set(row.get("extensions", {}))
        pbr = as_object(told)
        rough, metal = float(pbr.get("roughnessFactor", 1.0)), float(pbr.get("metallicFactor", 1.0))
        if not lit or not pbr:
            rough, metal = 1.0, 0.0  # what is drawn without light has no gloss either
        both, mirrored = bool(row.get("doubleSided")), self._laid(pbr.get("metallicRoughnessTexture"), like, name)
        shade = self._laid(row.get("occlusionTexture"), like, name)
        occlusion = None if shade is None else occluded(shade[..., 0], float(row["occlusionTexture"].get("strength", 1.0)))
        green, blue = (None, None) if mirrored is None else (mirrored[..., 1], mirrored[..., 2])
        rest = (255, round(255 * min(1.0, rough)), round(255 * min(1.0, metal)))
        finish = together([occlusion, times(green, rough), times(blue, metal)], rest)
        normal = self._laid(row.get("normalTexture"), like, name)
        if normal is not None:
            normal = steeper(normal, float(row["normalTexture"].get("scale", 1.0)))
        strength = float(row.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0))
        r, g, b = (strength * float(f) for f in row.get("emissiveFactor", (0.0, 0.0, 0.0)))
        glow = self._laid(row.get("emissiveTexture"), like, name) if r + g + b > 0.0 else None
        opacity, mode = None, row.get("alphaMode", "OPAQUE")
        if mode != "OPAQUE":
            opacity = self.alpha(row)
            if opacity is not None:
                opacity = times(_small(opacity), min(1.0, solid))
            elif solid < 1.0:
                opacity = np.full((4, 4), round(255 * max(0.0, solid)), np.uint8)
        if told is None and finish is None and normal is None and opacity is None and not both and r + g + b == 0.0:
            return None
        looks = Finish.of(rough, metal) or Finish(1.0, 0.0)
        cutoff = float(row.get("alphaCutoff", 0.5)) if mode == "MASK" else 0.5
        return Patch(
            roughness=looks.roughness,
            metallic=looks.metallic,
            finish=finish,
            normal=normal,
            glow=(r, g, b),
            glow_picture=glow,
            opacity=opacity,
            cutoff=min(1.0, max(0.004, cutoff)),
            blend=mode == "BLEND",
            both_sides=both,
        )

    def _laid(self, info: Any, like: Lying, name: str) -> U8 | None:
        """A picture as it lies on what shows the colour."""
        info = as_object(info)
        if "index" not in info:
            return None
        picture = self._picture(info, name)
        if picture is None:
            return None
        out = laid(picture, self.lying(info), like)
        if out is None:
            where = f"texture {self._picture_name(info)} of material {name!r}"
            self._notes.append(f"{where} has texture coordinates of its own: left out; bake it on those of its colour")
        return out

    def _finish(self, row: dict[str, Any]) -> Finish | None:
        """Its factors, times the means of a texture where there is one."""
        if not isinstance(row.get("pbrMetallicRoughness"), dict):
            return None
        told = as_object(row["pbrMetallicRoughness"])
        try:
            factors = np.array([told.get("roughnessFactor", 1.0), told.get("metallicFactor", 1.0)], np.float64)
        except (TypeError, ValueError):
            return None
        if "index" in told.get("metallicRoughnessTexture", {}):
            picture = self._picture(told["metallicRoughnessTexture"], str(row.get("name", "")))
            if picture is not None:
                factors *= picture[..., 1:3].reshape(-1, 2).mean(axis=0) / 255.0
        return Finish.of(*factors.tolist())

    def _picture(self, info: dict[str, Any], name: str) -> U8 | None:
        """One array for all materials that show the same picture."""
        if info["index"] not in self._pictures:
            where = f"texture {self._picture_name(info)} of material {name!r}"
            self._pictures[info["index"]] = decoded(self._picture_data(info), self._notes, where)
        return self._pictures[info["index"]]

    def _picture_data(self, info: dict[str, Any]) -> bytes | None:
        if "index" not in info:
            return None
        texture = self._document.row("textures", info["index"])
        other = next((e["source"] for e in map(as_object, texture.get("extensions", {}).values()) if "source" in e), None)
        try:
            return self._document.picture(texture.get("source", other))
        except MakingError:
            return None

    def _picture_name(self, info: dict[str, Any]) -> str:
        image = self._document.row("textures", info["index"]).get("source")
        rows = self._document.rows("images")
        row = rows[image] if isinstance(image, int) and 0 <= image < len(rows) else {}
        uri = str(row.get("uri", ""))
        return str(row.get("name") or ("" if uri.startswith("data:") else uri) or f"number {image}")


def colour_texture(row: dict[str, Any]) -> dict[str, Any]:
    """What the material says of the texture of its colour, {} without one."""
    old = row.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness", {}).get("diffuseTexture", {})
    return row.get("pbrMetallicRoughness", {}).get("baseColorTexture", old)


def layout(row: dict[str, Any]) -> dict[str, Any]:
    """The texture as which all of a material's lie: that of its colour, else the first it has."""
    pbr = row.get("pbrMetallicRoughness", {})
    others = (
        row.get("normalTexture"),
        pbr.get("metallicRoughnessTexture"),
        row.get("occlusionTexture"),
        row.get("emissiveTexture"),
    )
    return next((i for i in map(as_object, (colour_texture(row), *others)) if "index" in i), dict[str, Any]())


def _small(channel: U8) -> U8:
    step = max(1, -(-max(channel.shape) // LARGEST))
    return channel if step == 1 else scaled(channel, (max(1, channel.shape[0] // step), max(1, channel.shape[1] // step)))

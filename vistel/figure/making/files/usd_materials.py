"""Materials of USD meshes as a figure needs them: colour or picture of a UsdPreviewSurface, and its other surface properties."""

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, UsdGeom, UsdShade

from vistel.colour import srgb
from vistel.figure.making.files.usd_inside import asset_bytes
from vistel.figure.making.files.usd_patches import Inputs, channel_of, connections, lying_of, patch_read, texture_reader
from vistel.figure.making.maps import Lying
from vistel.figure.making.pictures import alpha_of, decoded
from vistel.figure.making.source import Finish, MakingError, SourceMaterial

_PLAIN = 64
"""Texels along a side of the colour of a material that has other pictures only."""
_DEEP = 8
"""Shaders in a row through which a colour is followed to its picture."""


class Materials:
    """Those of a stage, in the order in which they were met; the first has no name. patches: read other surface properties too."""

    def __init__(self, stage: Any, path: Path, notes: list[str], *, patches: bool) -> None:
        self._stage, self._path, self._notes, self._patches = stage, path, notes, patches
        self._index: dict[str, int] = {"": 0}
        self._list = [SourceMaterial("")]
        self._pictures: dict[str, NDArray[np.uint8] | None] = {}

    def all(self) -> tuple[SourceMaterial, ...]:
        """Every material met so far; the first is that of faces without one."""
        return tuple(self._list)

    def of_faces(self, mesh: Any, faces: int) -> NDArray[np.int32]:
        """(faces,) material of each: the mesh's, or that of the subset it is in."""
        both = self._patches and bool(mesh.GetDoubleSidedAttr().Get())
        out = np.full(faces, self._of(mesh.GetPrim(), self._shown(mesh), both), np.int32)
        for subset in UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets():
            rows = np.array(UsdGeom.Subset(subset).GetIndicesAttr().Get() or [], np.int64)
            out[rows[(rows >= 0) & (rows < faces)]] = self._of(subset.GetPrim(), None, both)
        return out

    def _shown(self, mesh: Any) -> tuple[int, int, int] | None:
        """The mesh's display colour where it is one for all."""
        colour = mesh.GetDisplayColorAttr().Get()
        return _bytes(colour[0]) if colour is not None and len(colour) == 1 else None

    def _of(self, prim: Any, shown: tuple[int, int, int] | None, both: bool) -> int:
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        if not material:
            if shown is None:
                return 0
            return self._kept(f"displayColor {shown}", SourceMaterial("displayColor", shown))
        key = str(material.GetPath())
        own = self._index[key] if key in self._index else self._kept(key, self._read(material))
        patch = self._list[own].patch
        if not both or patch is None:
            return own
        return self._kept(f"{key} both sides", replace(self._list[own], patch=replace(patch, both_sides=True)))

    def _kept(self, key: str, material: SourceMaterial) -> int:
        if key not in self._index:
            self._index[key] = len(self._list)
            self._list.append(material)
        return self._index[key]

    def _read(self, material: Any) -> SourceMaterial:
        name = str(material.GetPrim().GetName())
        surface: Any = material.ComputeSurfaceSource()
        shader = cast(tuple[Any, ...], surface)[0] if isinstance(surface, tuple) else surface
        if not shader:
            return SourceMaterial(name)
        for wanted in ("diffuseColor", "base_color", "baseColor", "diffuse_color_constant", "diffuse_texture"):
            source = shader.GetInput(wanted)
            if not source:
                continue
            value = source.Get()
            colour = _bytes(value) if value is not None and hasattr(value, "__len__") and len(value) >= 3 else None
            asset = self._asset(source, 0)
            picture = None if asset is None else self._picture(asset, name)
            if asset is None and colour is None:
                continue
            out = SourceMaterial(name, colour, picture, self._finish(shader, name))
            if not self._patches or str(shader.GetIdAttr().Get()) != "UsdPreviewSurface":
                return out
            like = self._lying(source)
            patch = patch_read(shader, self._inputs(name), like, out.finish)
            if patch is not None and patch.pictures and picture is None:
                out = replace(out, picture=np.full((_PLAIN, _PLAIN, 3), colour or (46, 46, 46), np.uint8))
            return replace(out, patch=patch, wrap=like.wrap)
        return SourceMaterial(name)

    def _inputs(self, material: str) -> Inputs:
        def picture(source: Any) -> tuple[NDArray[np.uint8], Lying, str] | None:
            asset = self._asset(source, 0) if source.HasConnectedSource() else None
            found = self._picture(asset, material) if asset is not None else None
            return None if found is None else (found, self._lying(source), channel_of(source))

        def alpha(source: Any) -> NDArray[np.uint8] | None:
            asset = self._asset(source, 0)
            data = self._opened(asset) if asset is not None else None
            return None if data is None else alpha_of(data)

        return Inputs(picture, alpha, lambda note: self._notes.append(f"material {material!r}: {note}"))

    def _lying(self, source: Any) -> Lying:
        """How the picture lies that feeds an input, if one does."""
        reader = texture_reader(source)
        return Lying("st") if reader is None else lying_of(reader)

    def _finish(self, shader: Any, name: str) -> Finish | None:
        """Roughness and metallic; of pictures, their means. What a UsdPreviewSurface leaves out has its default."""
        preview = str(shader.GetIdAttr().Get()) == "UsdPreviewSurface"
        roughness = self._number(shader, ("roughness", "specular_roughness", "reflection_roughness_constant"), name)
        metallic = self._number(shader, ("metallic", "metalness", "metallic_constant"), name)
        if roughness is None and metallic is None and not preview:
            return None
        return Finish.of(0.5 if roughness is None else roughness, 0.0 if metallic is None else metallic)

    def _number(self, shader: Any, names: tuple[str, ...], material: str) -> float | None:
        """The first of these inputs that the shader has."""
        source = next((s for s in (shader.GetInput(n) for n in names) if s), None)
        if source is None:
            return None
        if source.HasConnectedSource():
            asset = self._asset(source, 0)
            picture = self._picture(asset, material) if asset is not None else None
            if picture is not None:
                rows = connections(source)
                channel = {"g": 1, "b": 2}.get(str(rows[0].sourceName), 0) if rows else 0
                return float(picture[..., channel].mean()) / 255.0
        value = source.Get()
        return float(value) if isinstance(value, int | float) else None

    def _asset(self, source: Any, deep: int) -> Any:
        """The first picture among the shaders that feed an input."""
        if deep > _DEEP:
            return None
        value = source.Get()
        if isinstance(value, Sdf.AssetPath) and value.path:
            return value
        for row in connections(source):
            feeding = UsdShade.ConnectableAPI(row.source.GetPrim())
            inputs = sorted(feeding.GetInputs(), key=lambda i: i.GetBaseName() != "file")
            for further in inputs:
                found = self._asset(further, deep + 1)
                if found is not None:
                    return found
        return None

    def _opened(self, asset: Any) -> bytes | None:
        try:
            return asset_bytes(asset.resolvedPath, self._path)
        except MakingError as fault:
            self._notes.append(f"texture {asset.path}: {fault}")
            return None

    def _picture(self, asset: Any, name: str) -> NDArray[np.uint8] | None:
        if asset.path not in self._pictures:
            where = f"texture {asset.path} of material {name!r}"
            self._pictures[asset.path] = decoded(self._opened(asset), self._notes, where)
        return self._pictures[asset.path]


def _bytes(linear_rgb: Any) -> tuple[int, int, int]:
    """USD's colours are linear light."""
    r, g, b = np.round(255.0 * srgb(np.clip(np.array(linear_rgb, np.float64)[:3], 0.0, 1.0))).astype(int).tolist()
    return r, g, b

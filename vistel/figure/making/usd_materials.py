"""Materials of USD meshes as a figure needs them: the diffuse colour or picture of a UsdPreviewSurface."""

# pyright: basic, reportAttributeAccessIssue=false

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.figure.making.pictures import decode
from vistel.figure.making.read_gltf import srgb
from vistel.figure.making.source import Finish, MakingError, Material

_DEEP = 8
"""Shaders in a row through which a colour is followed to its picture."""


class Materials:
    """Those of a stage, in the order in which they were met; the first has no name."""

    def __init__(self, stage: Any, notes: list[str]) -> None:
        self._stage, self._notes = stage, notes
        self._index: dict[str, int] = {"": 0}
        self._list = [Material("")]
        self._pictures: dict[str, NDArray[np.uint8] | None] = {}

    def all(self) -> tuple[Material, ...]:
        return tuple(self._list)

    def of_faces(self, mesh: Any, faces: int) -> NDArray[np.int32]:
        """(faces,) material of each: the mesh's, or that of the subset it is in."""
        from pxr import UsdGeom, UsdShade  # noqa: PLC0415

        out = np.full(faces, self._of(mesh.GetPrim(), self._shown(mesh)), np.int32)
        for subset in UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets():
            rows = np.array(UsdGeom.Subset(subset).GetIndicesAttr().Get() or [], np.int64)
            out[rows[(rows >= 0) & (rows < faces)]] = self._of(subset.GetPrim(), None)
        return out

    def _shown(self, mesh: Any) -> tuple[int, int, int] | None:
        """The mesh's display colour where it is one for all."""
        colour = mesh.GetDisplayColorAttr().Get()
        return _bytes(colour[0]) if colour is not None and len(colour) == 1 else None

    def _of(self, prim: Any, shown: tuple[int, int, int] | None) -> int:
        from pxr import UsdShade  # noqa: PLC0415

        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        if not material:
            if shown is None:
                return 0
            return self._kept(f"displayColor {shown}", Material("displayColor", shown))
        key = str(material.GetPath())
        return self._index[key] if key in self._index else self._kept(key, self._read(material))

    def _kept(self, key: str, material: Material) -> int:
        if key not in self._index:
            self._index[key] = len(self._list)
            self._list.append(material)
        return self._index[key]

    def _read(self, material: Any) -> Material:
        name = str(material.GetPrim().GetName())
        surface = material.ComputeSurfaceSource()
        shader = surface[0] if isinstance(surface, tuple) else surface
        if not shader:
            return Material(name)
        for wanted in ("diffuseColor", "base_color", "baseColor", "diffuse_color_constant", "diffuse_texture"):
            source = shader.GetInput(wanted)
            if not source:
                continue
            value = source.Get()
            colour = _bytes(value) if value is not None and hasattr(value, "__len__") and len(value) >= 3 else None
            asset = self._asset(source, 0)
            if asset is not None:
                return Material(name, colour, self._picture(asset, name), self._finish(shader, name))
            if colour is not None:
                return Material(name, colour, None, self._finish(shader, name))
        return Material(name)

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
                connected = source.GetConnectedSources()
                rows = connected[0] if isinstance(connected, tuple) else connected
                channel = {"g": 1, "b": 2}.get(str(rows[0].sourceName), 0) if rows else 0
                return float(picture[..., channel].mean()) / 255.0
        value = source.Get()
        return float(value) if isinstance(value, int | float) else None

    def _asset(self, source: Any, deep: int) -> Any:
        """The first picture among the shaders that feed an input."""
        from pxr import Sdf, UsdShade  # noqa: PLC0415

        if deep > _DEEP:
            return None
        value = source.Get()
        if isinstance(value, Sdf.AssetPath) and value.path:
            return value
        connected = source.GetConnectedSources()
        rows = connected[0] if isinstance(connected, tuple) else connected
        for row in rows:
            feeding = UsdShade.ConnectableAPI(row.source.GetPrim())
            inputs = sorted(feeding.GetInputs(), key=lambda i: i.GetBaseName() != "file")
            for further in inputs:
                found = self._asset(further, deep + 1)
                if found is not None:
                    return found
        return None

    def _picture(self, asset: Any, name: str) -> NDArray[np.uint8] | None:
        from pxr import Ar  # noqa: PLC0415

        if asset.path in self._pictures:
            return self._pictures[asset.path]
        opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(asset.resolvedPath)) if asset.resolvedPath else None
        picture = None
        where = f"texture {asset.path} of material {name!r}"
        if opened is None:
            self._notes.append(f"{where} is not there; a plain colour instead (put it beside the mesh, or --texture FILE)")
        else:
            try:
                picture = decode(bytes(opened.GetBuffer()), notes=self._notes, name=where)
            except MakingError as fault:
                self._notes.append(f"{where}: {fault}; a plain colour instead")
        self._pictures[asset.path] = picture
        return picture


def _bytes(linear_rgb: Any) -> tuple[int, int, int]:
    """USD's colours are linear light."""
    r, g, b = np.round(255.0 * srgb(np.clip(np.array(linear_rgb, np.float64)[:3], 0.0, 1.0))).astype(int).tolist()
    return r, g, b

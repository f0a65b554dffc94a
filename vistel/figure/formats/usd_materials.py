"""Materials of an avatar in USD: UsdPreviewSurface for the texture and for each of its patches, and back.

    /Avatar/Materials/Skin      where no patch is: the texture alone
    /Avatar/Materials/Patch_k   a patch; its pictures span its box, by UsdTransform2d; vistel:... hold it exactly

A mesh has a GeomSubset for each patch it shows.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from PIL import Image
from pxr import Gf, Sdf, UsdGeom, UsdShade, Vt

from vistel.figure.avatar.avatar import Mesh
from vistel.figure.avatar.patch import Patch, of_numbers, patch_of

_PICTURES = {"finish": "finish", "normal": "normal", "glow_picture": "glow", "opacity": "opacity"}
"""Fields of a patch, and what their pictures' names end in."""


def pictures_of(patches: tuple[Patch, ...], stem: str) -> dict[str, Image.Image]:
    """File names of the pictures of patches, and what is in them; `stem` begins every name."""
    return {
        name_of(stem, k, field): Image.fromarray(picture) for k, p in enumerate(patches) for field, picture in p.pictures.items()
    }


def name_of(stem: str, patch: int, field: str) -> str:
    """The file name of a patch's picture."""
    return f"{stem}_patch{patch}_{_PICTURES[field]}.png"


def write_materials(stage: Any, texture: str, stem: str, patches: tuple[Patch, ...]) -> tuple[Any, list[Any]]:
    """The material of what has no patch, and those of the patches; texture: file name of the colours."""
    UsdGeom.Scope.Define(stage, "/Avatar/Materials")
    plain = _Material(stage, "/Avatar/Materials/Skin", texture)
    plain.value("roughness", 0.7)
    return plain.material, [_patch(stage, k, p, texture, stem) for k, p in enumerate(patches)]


def _patch(stage: Any, k: int, patch: Patch, texture: str, stem: str) -> Any:
    out = _Material(stage, f"/Avatar/Materials/Patch_{k}", texture)
    out.keep(patch)
    for name, value in (("roughness", patch.roughness), ("metallic", patch.metallic)):
        out.value(name, value)
    if patch.finish is not None:
        picture = out.picture("Finish", name_of(stem, k, "finish"), patch)
        for name, channel in (("occlusion", "r"), ("roughness", "g"), ("metallic", "b")):
            out.connect(name, picture, channel)
    if patch.normal is not None:
        out.connect("normal", out.picture("Normal", name_of(stem, k, "normal"), patch, bumps=True), "rgb")
    if any(patch.glow):
        if patch.glow_picture is None:
            out.colour("emissiveColor", patch.glow)
        else:
            picture = out.picture("Glow", name_of(stem, k, "glow_picture"), patch, "sRGB", patch.glow)
            out.connect("emissiveColor", picture, "rgb")
    if patch.opacity is not None:
        out.connect("opacity", out.picture("Opacity", name_of(stem, k, "opacity"), patch), "r")
        if not patch.blend:
            out.value("opacityThreshold", patch.cutoff)
    return out.material


class _Material:
    """A material that is being written: colours of the texture, read at the mesh's coordinates."""

    def __init__(self, stage: Any, at: str, texture: str) -> None:
        self._stage, self._at = stage, at
        self.material = UsdShade.Material.Define(stage, at)
        self._surface = self._shader("Surface", "UsdPreviewSurface")
        self._reader = self._shader("TextureCoordinates", "UsdPrimvarReader_float2")
        self._reader.CreateInput("varname", self._types.String).Set("st")
        self._place: Any = self._reader.CreateOutput("result", self._types.Float2)
        self._on_patch: Any = None
        self.connect("diffuseColor", self._texture("Texture", texture, "sRGB", self._place), "rgb")
        self.material.CreateSurfaceOutput().ConnectToSource(self._surface.CreateOutput("surface", self._types.Token))

    @property
    def _types(self) -> Any:
        return Sdf.ValueTypeNames

    def keep(self, patch: Patch) -> None:
        """Attributes for data without an input, and exact numbers."""
        attribute = self.material.GetPrim().CreateAttribute("vistel:patch", self._types.DoubleArray, True, Sdf.VariabilityUniform)
        attribute.Set(list(patch.numbers))

    def value(self, name: str, number: float) -> None:
        self._surface.CreateInput(name, self._types.Float).Set(float(number))

    def colour(self, name: str, rgb: tuple[float, float, float]) -> None:
        self._surface.CreateInput(name, self._types.Color3f).Set(Gf.Vec3f(*rgb))

    def connect(self, name: str, picture: Any, channel: str) -> None:
        kinds = {"normal": self._types.Normal3f, "diffuseColor": self._types.Color3f, "emissiveColor": self._types.Color3f}
        kind = self._types.Float3 if channel == "rgb" else self._types.Float
        output = picture.GetOutput(channel) or picture.CreateOutput(channel, kind)
        self._surface.CreateInput(name, kinds.get(name, self._types.Float)).ConnectToSource(output)

    def picture(
        self,
        name: str,
        file: str,
        patch: Patch,
        space: str = "raw",
        factor: tuple[float, float, float] | None = None,
        *,
        bumps: bool = False,
    ) -> Any:
        """A picture that spans a patch; factor: of its colours; bumps: it is a normal map."""
        out = self._texture(name, file, space, self._across(patch))
        if factor is not None:
            out.CreateInput("scale", self._types.Float4).Set(Gf.Vec4f(*factor, 1.0))
        if bumps:
            out.CreateInput("scale", self._types.Float4).Set(Gf.Vec4f(2.0, 2.0, 2.0, 1.0))
            out.CreateInput("bias", self._types.Float4).Set(Gf.Vec4f(-1.0, -1.0, -1.0, 0.0))
        return out

    def _across(self, patch: Patch) -> Any:
        """Coordinates that go from 0 to 1 over the patch."""
        if self._on_patch is None:
            u, v, right, top = patch.box
            turned = self._shader("OnPatch", "UsdTransform2d")
            turned.CreateInput("in", self._types.Float2).ConnectToSource(self._place)
            turned.CreateInput("scale", self._types.Float2).Set(Gf.Vec2f(1.0 / (right - u), 1.0 / (top - v)))
            turned.CreateInput("translation", self._types.Float2).Set(Gf.Vec2f(-u / (right - u), -v / (top - v)))
            self._on_patch = turned.CreateOutput("result", self._types.Float2)
        return self._on_patch

    def _texture(self, name: str, file: str, space: str, place: Any) -> Any:
        out = self._shader(name, "UsdUVTexture")
        out.CreateInput("file", self._types.Asset).Set(Sdf.AssetPath(f"./{file}"))
        out.CreateInput("sourceColorSpace", self._types.Token).Set(space)
        out.CreateInput("st", self._types.Float2).ConnectToSource(place)
        if name != "Texture":
            for along in ("wrapS", "wrapT"):
                out.CreateInput(along, self._types.Token).Set("clamp")
        return out

    def _shader(self, name: str, kind: str) -> Any:
        out = UsdShade.Shader.Define(self._stage, f"{self._at}/{name}")
        out.CreateIdAttr(kind)
        return out


def bind(geometry: Any, mesh: Mesh, plain: Any, patches: tuple[Patch, ...], materials: list[Any]) -> None:
    """The materials on a mesh: one for all, or one for each of its patches."""
    api = UsdShade.MaterialBindingAPI.Apply(geometry.GetPrim())
    api.Bind(plain)
    on = patch_of(patches, mesh.uv, mesh.corner_triangles)
    if patches and any(patches[int(k)].both_sides for k in np.unique(on[on >= 0]).tolist()):
        UsdGeom.Gprim(geometry.GetPrim()).CreateDoubleSidedAttr(True)
    used: list[int] = np.unique(on).tolist() if patches else []
    for k in used:
        faces = Vt.IntArray.FromNumpy(np.ascontiguousarray(np.flatnonzero(on == k), np.int32))
        subset = api.CreateMaterialBindSubset(f"patch_{k}" if k >= 0 else "plain", faces, UsdGeom.Tokens.face)
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(materials[k] if k >= 0 else plain)
    if used:
        api.SetMaterialBindSubsetsFamilyType(UsdGeom.Tokens.partition)


def read_patches(stage: Any, root: Any, picture_of: Callable[[Any], Any]) -> tuple[Patch, ...]:
    """Those that `write_materials` wrote. picture_of: (H, W, 3) of an asset, or raises."""
    out: list[Patch] = []
    names = {"finish": "Finish", "normal": "Normal", "glow_picture": "Glow", "opacity": "Opacity"}
    while prim := stage.GetPrimAtPath(f"{root.GetPath()}/Materials/Patch_{len(out)}"):
        found: dict[str, Any] = {}
        for field, name in names.items():
            shader = stage.GetPrimAtPath(f"{prim.GetPath()}/{name}")
            if shader:
                picture = picture_of(shader.GetAttribute("inputs:file").Get())
                found[field] = np.ascontiguousarray(picture[..., 0]) if field == "opacity" else picture
        try:
            out.append(of_numbers([float(x) for x in prim.GetAttribute("vistel:patch").Get()], found))
        except ValueError as fault:
            raise ValueError(f"{prim.GetPath()}: {fault}") from fault
    return tuple(out)

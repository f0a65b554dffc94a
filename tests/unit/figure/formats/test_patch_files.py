"""What files say of surfaces beside their colour: read from glTF and USD of others, kept in every format of avatars."""

from __future__ import annotations

import io
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_fixture import chunks, foreign, small, write_glb
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdValidation, Vt

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.avatar.patch import Patch, from_arrays, patch_of, to_arrays
from vistel.figure.formats.avatar_file import save_avatar
from vistel.figure.formats.gltf import save_gltf
from vistel.figure.formats.load import load_any
from vistel.figure.formats.parcel import pack, unpack
from vistel.figure.formats.usd import save_usd
from vistel.figure.making.dress import placed
from vistel.figure.making.files.gltf import Document, read_document
from vistel.figure.making.files.gltf_materials import GltfMaterials
from vistel.figure.making.files.read import read_source
from vistel.figure.making.make import make_avatar
from vistel.figure.making.maps import CLAMP, MIRROR, REPEAT, Lying, laid, steeper, tiled
from vistel.figure.making.source import SourceMaterial

RNG = np.random.default_rng(4)
FIELDS = ("box", "roughness", "metallic", "glow", "cutoff", "blend", "both_sides")


def noise(*shape: int) -> np.ndarray:
    return RNG.integers(0, 256, shape, dtype=np.uint8)


@lru_cache(maxsize=1)
def patched() -> Avatar:
    """Her with one patch below the middle of her texture, another above it."""
    full = Patch(
        (0.0, 0.0, 1.0, 0.5),
        0.3,
        0.0,
        noise(8, 8, 3),
        noise(16, 8, 3),
        (0.5, 2.0, 0.25),
        noise(8, 8, 3),
        noise(8, 8),
        0.4,
        both_sides=True,
    )
    return replace(small(), patches=(full, Patch((0.0, 0.5, 1.0, 1.0), 0.25, 1.0)))


def alike(a: tuple[Patch, ...], b: tuple[Patch, ...]) -> None:
    assert len(a) == len(b)
    for one, other in zip(a, b, strict=True):
        for field in FIELDS:
            assert getattr(one, field) == pytest.approx(getattr(other, field)), field
        assert one.pictures.keys() == other.pictures.keys()
        for name, picture in one.pictures.items():
            np.testing.assert_array_equal(picture, other.pictures[name], err_msg=name)


@pytest.mark.parametrize("ending", [".npz", ".glb", ".vrm", ".usda", ".usdz"])
def test_an_avatar_keeps_its_patches_and_its_triangles_in_their_order(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"her{ending}"
    save = {".npz": save_avatar, ".glb": save_gltf, ".vrm": save_gltf}.get(ending, save_usd)
    save(patched(), path)
    again = load_any(path)
    alike(again.patches, patched().patches)
    np.testing.assert_array_equal(again.mesh.corner_triangles, patched().mesh.corner_triangles)
    assert all(level.patches == again.patches for level in again.coarser)


def test_opacity_lies_on_its_part_of_the_texture_once_and_older_files_are_read(tmp_path: Path) -> None:
    path = tmp_path / "her.glb"
    save_gltf(patched(), path)
    tree, binary = chunks(path)
    kept, opacity = tree["extensions"]["VISTEL_avatar"]["patches"][0], patched().patches[0].opacity
    assert {t["source"] for t in tree["textures"]} == set(range(len(tree["images"])))
    shown = Image.open(io.BytesIO(_image(tree, binary, kept["colour"])))
    assert shown.mode == "RGBA"
    assert shown.height <= patched().albedo.shape[0] / 2
    del kept["opacitySize"]
    with pytest.raises(AvatarFileError, match="opacity"):
        load_any(write_glb(path, tree | {"extensions": _with(tree, opacitySize=[9999, 8])}, binary))
    out = io.BytesIO()
    Image.fromarray(opacity).save(out, "PNG")
    tree["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(out.getvalue())})
    tree["images"].append({"mimeType": "image/png", "bufferView": len(tree["bufferViews"]) - 1})
    kept["opacity"] = len(tree["images"]) - 1
    write_glb(path, tree, binary + out.getvalue() + b"\0" * (-len(out.getvalue()) % 4))
    alike(load_any(path).patches, patched().patches)


def _image(tree: dict[str, Any], binary: bytes, index: int) -> bytes:
    view = tree["bufferViews"][tree["images"][index]["bufferView"]]
    return binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]


def _with(tree: dict[str, Any], **more: Any) -> dict[str, Any]:
    """The extensions of a tree whose first patch has these keys more."""
    kept = tree["extensions"]["VISTEL_avatar"]
    first, *rest = kept["patches"]
    return tree["extensions"] | {"VISTEL_avatar": kept | {"patches": [first | more, *rest]}}


def test_a_parcel_brings_patches_with_pictures_a_little_other_and_holes_as_they_are() -> None:
    smooth = np.tile(np.linspace(0, 255, 64).astype(np.uint8)[:, None, None], (1, 64, 3))
    sent = tuple(replace(p, **{n: smooth for n in p.pictures if n != "opacity"}) for p in patched().patches)  # type: ignore[arg-type]
    got = unpack(pack(replace(patched(), patches=sent)), "her").patches
    np.testing.assert_array_equal(got[0].opacity, sent[0].opacity)
    assert np.abs(got[0].normal.astype(int) - smooth).mean() < 3.0
    assert got[1].metallic == 1.0


@pytest.mark.parametrize("what", ["box", "numbers", "picture", "many"])
def test_patches_that_are_damaged_are_refused_in_one_line(what: str) -> None:
    bad = {
        "box": replace(patched().patches[0], box=(0.5, 0.0, 0.5, 1.0)),
        "numbers": Patch(roughness=float("nan")),
        "picture": Patch(normal=np.zeros((4, 4), np.uint8)),
        "many": Patch(),
    }[what]
    with pytest.raises(AvatarFileError, match=r"^avatar.*patch"):
        pack(replace(patched(), patches=(bad,) * (100 if what == "many" else 1)))
    arrays = to_arrays(patched().patches)
    arrays["patch0.normal"] = arrays["patch0.normal"][:40]
    with pytest.raises(ValueError, match="normal"):
        from_arrays(arrays, 4096)


def test_what_usd_says_is_a_preview_surface_that_others_read(tmp_path: Path) -> None:
    path = tmp_path / "her.usda"
    save_usd(patched(), path)
    stage = Usd.Stage.Open(str(path))
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    assert [error.GetMessage() for error in context.Validate(stage)] == []
    skin = stage.GetPrimAtPath("/Avatar/Skin")
    assert UsdGeom.Gprim(skin).GetDoubleSidedAttr().Get()
    subsets = UsdShade.MaterialBindingAPI(skin).GetMaterialBindSubsets()
    bound = {UsdShade.MaterialBindingAPI(s.GetPrim()).ComputeBoundMaterial()[0].GetPrim().GetName() for s in subsets}
    assert bound == {"Patch_0", "Patch_1"}
    assert sum(len(s.GetIndicesAttr().Get()) for s in subsets) == len(patched().mesh.triangles)
    surface = UsdShade.Shader(stage.GetPrimAtPath("/Avatar/Materials/Patch_0/Surface"))
    for name, texture, channel in (
        ("occlusion", "Finish", "r"),
        ("roughness", "Finish", "g"),
        ("metallic", "Finish", "b"),
        ("normal", "Normal", "rgb"),
        ("emissiveColor", "Glow", "rgb"),
        ("opacity", "Opacity", "r"),
    ):
        source = surface.GetInput(name).GetConnectedSources()[0][0]
        assert (source.source.GetPrim().GetName(), source.sourceName) == (texture, channel)
    assert surface.GetInput("opacityThreshold").Get() == pytest.approx(0.4)
    metal = UsdShade.Shader(stage.GetPrimAtPath("/Avatar/Materials/Patch_1/Surface"))
    assert metal.GetInput("metallic").Get() == 1.0


@pytest.mark.parametrize("ending", [".glb", ".usda"])
def test_what_is_written_reads_the_same_as_a_file_of_others(tmp_path: Path, ending: str) -> None:
    only = replace(patched().patches[0], box=(0.0, 0.0, 1.0, 1.0), opacity=np.full((8, 8), 255, np.uint8))
    her = replace(small(), patches=(only,), albedo=noise(64, 64, 3))
    if ending == ".glb":
        path = foreign(tmp_path, avatar=her)
    else:
        path = tmp_path / "her.usda"
        save_usd(her, path)
        text = path.read_text("utf-8").replace("vistel:format", "other:format")
        path.write_text(text, "utf-8")
    source = read_source(path)
    found = next(m.patch for m in reversed(source.materials) if m.patch is not None and m.patch.normal is not None)
    np.testing.assert_array_equal(found.normal, only.normal)
    np.testing.assert_array_equal(found.finish, only.finish)
    np.testing.assert_array_equal(found.glow_picture, only.glow_picture)
    assert found.glow == pytest.approx(only.glow)
    assert found.both_sides
    assert found.cutoff == pytest.approx(0.4)
    assert not found.blend


class _Pictures(Document):
    """A document whose textures are arrays."""

    def __init__(self, tree: dict[str, Any], *pictures: np.ndarray) -> None:
        super().__init__(Path("theirs.gltf"), {"textures": [{"source": i} for i in range(len(pictures))]} | tree, b"")
        self.__dict__["arrays"] = pictures

    def picture(self, image: Any) -> bytes:
        out = io.BytesIO()
        Image.fromarray(self.__dict__["arrays"][image]).save(out, "PNG")
        return out.getvalue()


def read(row: dict[str, Any], *pictures: np.ndarray, tree: dict[str, Any] | None = None) -> tuple[SourceMaterial, list[str]]:
    notes: list[str] = []
    return GltfMaterials(_Pictures(tree or {}, *pictures), notes, patches=True).material(row), notes


def test_factors_and_channels_of_gltf_are_multiplied_and_put_together() -> None:
    mirrored, shade = np.full((4, 4, 3), (9, 200, 100), np.uint8), np.full((8, 8, 3), (100, 0, 0), np.uint8)
    material, _ = read(
        {
            "pbrMetallicRoughness": {"roughnessFactor": 0.5, "metallicFactor": 0.2, "metallicRoughnessTexture": {"index": 0}},
            "occlusionTexture": {"index": 1, "strength": 0.5},
            "normalTexture": {"index": 0, "scale": 1.0},
            "doubleSided": True,
            "emissiveFactor": [1.0, 0.5, 0.0],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4.0}},
        },
        mirrored,
        shade,
    )
    patch = material.patch
    assert patch is not None
    assert patch.finish[0, 0].tolist() == [178, 100, 20]
    assert patch.finish.shape == (8, 8, 3)
    assert patch.glow == (4.0, 2.0, 0.0)
    assert patch.both_sides
    assert material.picture is not None  # its pictures need a place on the texture


def test_unlit_materials_shine_and_mirror_nothing() -> None:
    material, _ = read({"pbrMetallicRoughness": {"metallicFactor": 1.0}, "extensions": {"KHR_materials_unlit": {}}})
    assert (material.patch.roughness, material.patch.metallic) == (1.0, 0.0)


def test_masks_have_their_cutoff_and_blends_are_halves() -> None:
    colour = np.zeros((4, 4, 4), np.uint8)
    colour[..., 3] = 128
    pbr = {"baseColorTexture": {"index": 0}, "baseColorFactor": [1.0, 1.0, 1.0, 0.5]}
    mask, _ = read({"pbrMetallicRoughness": pbr, "alphaMode": "MASK", "alphaCutoff": 0.2}, colour)
    blend, _ = read({"pbrMetallicRoughness": pbr, "alphaMode": "BLEND"}, colour)
    solid, _ = read({"pbrMetallicRoughness": pbr}, colour)
    assert (mask.patch.cutoff, mask.patch.blend, int(mask.patch.opacity[0, 0])) == (0.2, False, 64)
    assert blend.patch.blend
    assert solid.patch.opacity is None


def test_a_picture_that_lies_otherwise_than_the_colour_is_laid_as_that_one_is() -> None:
    colour, bumps = noise(16, 16, 3), noise(16, 16, 3)
    moved = {"index": 1, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.25]}}}
    material, _ = read({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": moved}, colour, bumps)
    np.testing.assert_array_equal(material.patch.normal, np.roll(bumps, (-4, -8), axis=(0, 1)))
    other, notes = read(
        {"name": "coat", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": {"index": 1, "texCoord": 1}},
        colour,
        bumps,
    )
    assert other.patch.normal is None
    assert any("'coat'" in n and "coordinates of its own" in n for n in notes)


def test_wrap_modes_decide_where_faces_beyond_the_picture_lie() -> None:
    uv = np.array([[[1.2, 0.1], [1.4, 0.1], [1.3, 0.3]]])
    assert placed(uv, (REPEAT, REPEAT))[0][0, 0].tolist() == pytest.approx([0.2, 0.1])
    mirrored, low, high = placed(uv, (MIRROR, REPEAT))
    assert mirrored[0, 0].tolist() == pytest.approx([1.2, 0.1])
    assert (low, high) == ((0, 0), (2, 1))
    assert placed(uv, (CLAMP, CLAMP))[0][0, 0].tolist() == pytest.approx([1.2, 0.1])
    across = np.array([[[0.5, 0.5], [1.7, 0.5], [0.5, 0.9]]])
    assert placed(across, (REPEAT, REPEAT))[1:] == ((0, 0), (2, 1))
    picture = noise(4, 4, 3)
    np.testing.assert_array_equal(tiled(picture, (0, 0), (2, 1), (MIRROR, REPEAT)), np.hstack([picture, picture[:, ::-1]]))


def test_a_normal_map_gets_as_steep_as_its_scale_says_and_a_turned_lie_samples_turned() -> None:
    n = np.full((2, 2, 3), (192, 128, 237), np.uint8)
    flat = steeper(n, 0.0)
    assert flat[0, 0].tolist() in ([128, 128, 255], [127, 127, 255], [128, 127, 255], [127, 128, 255])
    quarter = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    picture = noise(8, 8)
    np.testing.assert_array_equal(laid(picture, Lying("st", quarter), Lying("st")), np.rot90(picture, -1))


def test_usd_of_others_has_its_maps_and_is_two_sided_where_its_mesh_is(tmp_path: Path) -> None:
    bumps = noise(16, 16, 3)
    Image.fromarray(bumps).save(tmp_path / "bumps.png")
    path = tmp_path / "theirs.usda"
    stage = Usd.Stage.CreateNew(str(path))
    mesh = UsdGeom.Mesh.Define(stage, "/Body")
    p = small().mesh
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(p.vertices))
    mesh.CreateFaceVertexCountsAttr([3] * len(p.triangles))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(p.triangles.reshape(-1))))
    mesh.CreateDoubleSidedAttr(True)
    material = UsdShade.Material.Define(stage, "/Coat")
    surface, picture = (UsdShade.Shader.Define(stage, f"/Coat/{n}") for n in ("Surface", "Bumps"))
    surface.CreateIdAttr("UsdPreviewSurface")
    picture.CreateIdAttr("UsdUVTexture")
    picture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath("./bumps.png"))
    normal = picture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    surface.CreateInput("normal", Sdf.ValueTypeNames.Normal3f).ConnectToSource(normal)
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(0.2, 0.1, 0.1))
    surface.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.8)
    surface.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(0.0, 0.0, 0.5))
    material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    stage.GetRootLayer().Save()
    found = next(m.patch for m in reversed(read_source(path).materials) if m.patch is not None)
    np.testing.assert_array_equal(found.normal, bumps)
    assert (found.metallic, found.roughness, found.both_sides, found.glow) == (0.8, 0.5, True, (0.0, 0.0, 0.5))


@pytest.mark.parametrize(("file", "said"), [("sofa_03_1k", {"finish", "normal"}), ("wooden_table_02_1k", {"finish", "normal"})])
def test_materials_that_people_painted_are_read_whole(shared_data: Path, file: str, said: set[str]) -> None:
    path = shared_data / "room" / file / f"{file}.gltf"
    if not path.is_file():
        pytest.skip(f"{path} is not there")
    document = read_document(path)
    notes: list[str] = []
    patch = GltfMaterials(document, notes, patches=True).material(document.rows("materials")[0]).patch
    assert patch is not None
    assert set(patch.pictures) >= said
    mean = patch.normal.reshape(-1, 3).mean(axis=0)
    assert abs(mean[0] - 128) < 6 and abs(mean[1] - 128) < 6 and mean[2] > 200
    assert 0.2 < patch.finish[..., 1].mean() / 255.0 < 1.0


def test_triangles_know_their_patch_by_their_middle() -> None:
    on = patch_of(patched().patches, small().mesh.uv, small().mesh.corner_triangles)
    middle = small().mesh.uv[small().mesh.corner_triangles].mean(axis=1)[:, 1]
    assert set(np.unique(on)) == {0, 1}
    assert (on[middle < 0.499] == 0).all()
    assert (on[middle > 0.501] == 1).all()


def test_an_imported_person_has_the_patches_of_her_file_on_all_levels(tmp_path: Path) -> None:
    holes = np.full((16, 16), 255, np.uint8)
    holes[::4] = 0
    her = replace(patched(), patches=(replace(patched().patches[0], opacity=holes), patched().patches[1]))
    made = make_avatar(read_source(foreign(tmp_path, avatar=her)), name="her").avatar
    by_metal = {p.metallic: p for p in made.patches}
    assert by_metal[1.0].roughness == 0.25
    maps = next(p for p in made.patches if p.normal is not None)
    assert {"normal", "finish", "glow_picture", "opacity"} == set(maps.pictures)
    for level in (made, *made.coarser):
        on = patch_of(made.patches, level.mesh.uv, level.mesh.corner_triangles)
        assert (on >= 0).mean() > 0.99
        assert level.patches == made.patches

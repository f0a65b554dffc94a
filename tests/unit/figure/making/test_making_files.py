"""Files made by others become avatars: glTF, VRM and USD with whatever units, axes, names and gaps they have."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_fixture import chunks, foreign, near, rename, small, under_root, write_glb
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdSkel, Vt

from vistel.figure.making.files.read import read_source
from vistel.figure.making.make import make_avatar
from vistel.figure.making.places import joints_by_place
from vistel.figure.making.rigs import mapped
from vistel.figure.making.source import MakingError, SourceMesh
from vistel.figure.making.upright import Upright, upright
from vistel.figure.rigid.weights import joints_only
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS
from vistel.geometry.rotation import matrix_from_rotvec

_Z_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""From Y up to Z up."""


def _placed(source: SourceMesh) -> Upright:
    known = mapped(source.rig)
    return upright(source.points, left=known.left(), head=known.head(), stated=(source.unit, source.up))


def _stands(source: SourceMesh) -> None:
    """Upright, in metres, facing +Z, with the joints where hers are."""
    placed, known = _placed(source), mapped(source.rig)
    p = placed(source.points)
    assert np.ptp(p[:, 1]) == pytest.approx(np.ptp(small().mesh.vertices[:, 1]), abs=0.005)
    for name in ("left_hand", "right_foot", "head", "left_toes"):
        at = placed(known.at[name][None])[0]
        np.testing.assert_allclose(at, small().skeleton.rest[JOINT_INDEX[name]], atol=0.02, err_msg=name)


def test_gltf_of_others_stands_where_she_stands(tmp_path: Path) -> None:
    source = read_source(foreign(tmp_path))
    _stands(source)
    assert source.groups == ("skin", "left_eye", "right_eye")
    near(source.materials[0].picture, small().albedo)


@pytest.mark.parametrize(
    ("matrix", "said"),
    [
        (np.diag((100.0, 100.0, 100.0, 1.0)), ["centimetres", "its unit of 1 m"]),
        (_Z_UP, ["Z is up", "though the file says Y"]),
        (_Z_UP @ np.diag((1000.0, 1000.0, 1000.0, 1.0)), ["Z is up", "millimetres"]),
        (np.diag((-1.0, 1.0, -1.0, 1.0)), ["face +Z"]),
    ],
)
def test_units_and_axes_that_the_file_has_wrong_are_found_and_reported(tmp_path: Path, matrix: np.ndarray, said: list[str]) -> None:
    source = read_source(foreign(tmp_path, under_root(matrix)))
    _stands(source)
    notes = " ".join(_placed(source).notes)
    for words in said:
        assert words in notes


def test_a_rig_with_unknown_names_is_mapped_by_position_and_shown(tmp_path: Path) -> None:
    made = make_avatar(read_source(foreign(tmp_path, rename)), name="eva")
    assert made.weights_from == "rig"
    assert "by position" in made.skeleton_from
    told = next(note for note in made.notes if "told by position" in note)
    for joint in ("left_upper_arm", "right_lower_leg", "hips", "head", "left_index_proximal", "right_thumb_distal"):
        assert f"Knochen.{JOINT_INDEX[joint]:03d} = {joint}" in told
    wrong = [n for n, ours in made.joint_of.items() if ours not in ("spine", JOINTS[int(n[-3:])])]
    assert wrong == []


def test_a_rig_with_unknown_names_is_mapped_with_hanging_arms_too() -> None:
    a = small()
    turn = np.tile(np.eye(3), (len(JOINTS), 1, 1))
    for name, sign in (("left_upper_arm", -1.0), ("right_upper_arm", 1.0)):
        turn[JOINT_INDEX[name]] = matrix_from_rotvec(np.array((0.0, 0.0, sign * 1.35)))
    at, world = a.skeleton.rest.copy(), turn.copy()
    for j in range(1, len(JOINTS)):
        world[j] = world[PARENTS[j]] @ turn[j]
        at[j] = at[PARENTS[j]] + world[PARENTS[j]] @ a.skeleton.offsets[j]
    found = joints_by_place(at, PARENTS, a.skeleton.height)
    assert {JOINTS[j] for j in found} >= {"left_hand", "right_lower_arm", "left_foot", "right_toes", "neck", "head", "hips"}
    assert [(JOINTS[j], ours) for j, ours in found.items() if ours not in ("spine", JOINTS[j])] == []


def test_a_rig_unlike_a_person_is_not_mapped() -> None:
    rng = np.random.default_rng(2)
    assert joints_by_place(rng.normal(size=(40, 3)), np.arange(-1, 39, dtype=np.int32), 1.7) == {}


def _vrm_0(tree: dict[str, Any]) -> None:
    """As VRM 0.x has it: facing -Z, its own map of bones, joints with names nobody knows."""
    bones = tree["extensions"].pop("VRMC_vrm")["humanoid"]["humanBones"]
    thumbs = {"ThumbProximal": "ThumbIntermediate", "ThumbMetacarpal": "ThumbProximal"}
    rows = []
    for name, bone in bones.items():
        old = next((name.replace(new, before) for new, before in thumbs.items() if name.endswith(new)), name)
        rows.append({"bone": old, "node": bone["node"]})
    tree["extensions"]["VRM"] = {"humanoid": {"humanBones": rows}}
    tree["extensionsUsed"] = ["VRM"]
    under_root(np.diag((-1.0, 1.0, -1.0, 1.0)))(tree)
    rename(tree)


@pytest.mark.parametrize(("change", "kind"), [(rename, "VRM 1.0"), (_vrm_0, "VRM 0.x")])
def test_vrm_says_which_joint_is_whose(tmp_path: Path, change: Callable[[dict[str, Any]], None], kind: str) -> None:
    source = read_source(foreign(tmp_path, change, ending=".vrm"))
    _stands(source)
    known = mapped(source.rig)
    assert any(kind in note for note in source.notes)
    at = _placed(source)(known.at["left_thumb_metacarpal"][None])[0]
    np.testing.assert_allclose(at, small().skeleton.rest[JOINT_INDEX["left_thumb_metacarpal"]], atol=0.02)
    assert "Knochen.022" in known.joint_of


def test_a_pose_other_than_the_one_it_was_bound_in_is_what_is_read(tmp_path: Path) -> None:
    def bend(tree: dict[str, Any]) -> None:
        for name, z in (("left_upper_arm", -1.0), ("right_upper_arm", 1.0)):
            tree["nodes"][JOINT_INDEX[name]]["rotation"] = [0.0, 0.0, z * float(np.sin(0.35)), float(np.cos(0.35))]

    made = make_avatar(read_source(foreign(tmp_path, bend)), name="eva")
    assert made.pose_angle == pytest.approx(0.7, abs=0.02)
    rest = made.avatar.skeleton.rest
    assert abs(rest[JOINT_INDEX["left_hand"], 1] - rest[JOINT_INDEX["left_upper_arm"], 1]) < 1e-9


def _separate(folder: Path, change: Callable[[dict[str, Any]], None] = lambda _: None) -> Path:
    """A .gltf with its data and its picture in files beside it."""
    tree, binary = chunks(foreign(folder))
    tree["buffers"][0]["uri"] = "her%20data.bin"
    (folder / "her data.bin").write_bytes(binary)
    view = tree["bufferViews"][tree["images"][0].pop("bufferView")]
    (folder / "skin.png").write_bytes(binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
    tree["images"][0] = {"uri": "skin.png"}
    change(tree)
    path = folder / "theirs.gltf"
    path.write_text(json.dumps(tree))
    return path


def test_gltf_with_files_beside_it(tmp_path: Path) -> None:
    path = _separate(tmp_path)
    source = read_source(path)
    near(source.materials[0].picture, small().albedo)
    (tmp_path / "skin.png").unlink()
    without = read_source(path)
    assert without.materials[0].picture is None
    assert any("skin.png" in note and "--texture" in note for note in without.notes)
    (tmp_path / "skin.png").write_bytes(b"no picture")
    assert any("not a picture" in note for note in read_source(path).notes)
    (tmp_path / "her data.bin").unlink()
    with pytest.raises(MakingError, match=r"her data\.bin"):
        read_source(path)


def _set(*where: Any, to: Any) -> Callable[[dict[str, Any]], None]:
    def change(tree: dict[str, Any]) -> None:
        at: Any = tree
        for key in where[:-1]:
            at = at[key]
        at[where[-1]] = to

    return change


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (_set("extensionsRequired", to=["KHR_draco_mesh_compression"]), "without compression"),
        (_set("asset", "version", to="1.0"), "expected 2.0"),
        (_set("meshes", 0, "primitives", 0, "indices", to=999), "accessors"),
        (_set("nodes", 3, "children", to=[0]), "not one|ring"),
        (_set("accessors", 0, "count", to=10**9), "damaged|cut short|beyond"),
        (_set("skins", 0, "joints", to=[0, 1]), "fit no joints"),
        (_set("meshes", to=[]), "meshes"),
        (_set("scenes", 0, "nodes", to=[0]), "no triangles"),
        (_set("buffers", 0, "uri", to="../../etc/passwd"), "beside it"),
    ],
)
def test_gltf_that_cannot_be_used_is_refused_with_what_to_do(
    tmp_path: Path, change: Callable[[dict[str, Any]], None], what: str
) -> None:
    with pytest.raises(MakingError, match=what) as refused:
        read_source(foreign(tmp_path, change))
    assert "\n" not in str(refused.value)


def test_colours_and_transforms_of_textures_are_taken(tmp_path: Path) -> None:
    def change(tree: dict[str, Any]) -> None:
        look = tree["materials"][0]["pbrMetallicRoughness"]
        look["baseColorFactor"] = [0.5, 1.0, 1.0, 1.0]
        look["baseColorTexture"]["extensions"] = {"KHR_texture_transform": {"offset": [0.25, 0.0], "scale": [0.5, 0.5]}}

    source, plain = read_source(foreign(tmp_path, change)), read_source(foreign(tmp_path))
    picture, before = source.materials[0].picture, plain.materials[0].picture
    assert picture is not None
    assert before is not None
    np.testing.assert_array_equal(picture[..., 1], before[..., 1])
    assert picture[..., 0].mean() < 0.8 * before[..., 0].mean()
    np.testing.assert_allclose(source.uv[:, 0], 0.25 + 0.5 * plain.uv[:, 0], atol=1e-6)
    np.testing.assert_allclose(1.0 - source.uv[:, 1], 0.5 * (1.0 - plain.uv[:, 1]), atol=1e-6)


def test_what_is_transparent_is_left_out(tmp_path: Path) -> None:
    def change(tree: dict[str, Any]) -> None:
        tree["materials"][0]["alphaMode"] = "MASK"
        out = io.BytesIO()
        half = np.full((8, 8, 4), 255, np.uint8)
        half[:4, :, 3] = 0
        Image.fromarray(half).save(out, "PNG")
        data = tree["_data"] = out.getvalue()
        tree["bufferViews"].append({"buffer": 0, "byteOffset": tree["buffers"][0]["byteLength"], "byteLength": len(data)})
        tree["images"][0]["bufferView"] = len(tree["bufferViews"]) - 1

    path = foreign(tmp_path)
    tree, binary = chunks(path)
    binary = binary[: tree["buffers"][0]["byteLength"]]
    change(tree)
    binary += tree.pop("_data")
    source, whole = read_source(write_glb(path, tree, binary)), small()
    total = sum(len(m.triangles) for m in (whole.mesh, *whole.eyeballs))
    assert 0.2 * total < len(source.triangles) < 0.8 * total
    assert any("transparent" in note for note in source.notes)


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    tree=st.recursive(
        st.none() | st.booleans() | st.integers(-2, 5) | st.floats() | st.text(max_size=4),
        lambda inside: (
            st.lists(inside, max_size=3)
            | st.dictionaries(
                st.sampled_from(
                    ["nodes", "meshes", "mesh", "primitives", "attributes", "POSITION", "accessors", "children", "skins"]
                ),
                inside,
                max_size=4,
            )
        ),
        max_leaves=12,
    )
)
def test_trees_that_are_nonsense_are_refused(tmp_path: Path, tree: Any) -> None:
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps({**(tree if isinstance(tree, dict) else {"nodes": tree}), "asset": {"version": "2.0"}}))
    with pytest.raises(MakingError) as refused:
        read_source(path)
    assert "\n" not in str(refused.value)


def _usd(path: Path, *, unit: float | None, z_up: bool | None, names: Callable[[int], str], texture: str = "skin.png") -> Path:
    """Her as another program might write her: body and head apart, quads' triangles, its own names, axes and unit."""
    stage = Usd.Stage.CreateNew(str(path))
    if unit is not None:
        UsdGeom.SetStageMetersPerUnit(stage, unit)
    if z_up is not None:
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z if z_up else UsdGeom.Tokens.y)
    size = 1.0 / (unit or 1.0)
    world = np.diag((size, size, size, 1.0)) if not z_up else _Z_UP @ np.diag((size, size, size, 1.0))
    top = UsdGeom.Xform.Define(stage, "/World")
    top.AddTransformOp().Set(Gf.Matrix4d(*world.T.reshape(-1).tolist()))
    root = UsdSkel.Root.Define(stage, "/World/Figur")
    paths: list[str] = []
    for j in range(len(JOINTS)):
        paths.append(names(j) if PARENTS[j] < 0 else f"{paths[PARENTS[j]]}/{names(j)}")
    skeleton = UsdSkel.Skeleton.Define(stage, "/World/Figur/Rig")
    skeleton.CreateJointsAttr(paths)
    rest, offsets = small().skeleton.rest, small().skeleton.offsets
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray([Gf.Matrix4d(1.0).SetTranslate(Gf.Vec3d(*p)) for p in rest.tolist()]))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([Gf.Matrix4d(1.0).SetTranslate(Gf.Vec3d(*p)) for p in offsets.tolist()]))
    material = UsdShade.Material.Define(stage, "/World/Haut")
    surface = UsdShade.Shader.Define(stage, "/World/Haut/S")
    surface.CreateIdAttr("UsdPreviewSurface")
    reader = UsdShade.Shader.Define(stage, "/World/Haut/T")
    reader.CreateIdAttr("UsdUVTexture")
    reader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(texture)
    colour = surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    colour.ConnectToSource(reader.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
    material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    mesh = small().mesh
    assert mesh.bone is not None
    assert mesh.weight is not None
    bone, weight = joints_only(mesh.bone, mesh.weight)
    head = (mesh.vertices[mesh.triangles, 1] > rest[JOINT_INDEX["neck"], 1]).all(axis=1)
    for name, rows in (("Kopf", head), ("Koerper", ~head)):
        used, tri = np.unique(mesh.triangles[rows], return_inverse=True)
        geometry = UsdGeom.Mesh.Define(stage, f"/World/Figur/{name}")
        geometry.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(mesh.vertices[used]))
        geometry.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(int(rows.sum()), 3, np.int32)))
        geometry.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(tri.reshape(-1).astype(np.int32)))
        st_ = UsdGeom.PrimvarsAPI(geometry).CreatePrimvar("UVMap", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
        st_.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(mesh.uv[mesh.corner_triangles[rows].reshape(-1)])))
        binding = UsdSkel.BindingAPI.Apply(geometry.GetPrim())
        binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
        binding.CreateJointIndicesPrimvar(False, 4).Set(Vt.IntArray.FromNumpy(bone[used].reshape(-1).astype(np.int32)))
        binding.CreateJointWeightsPrimvar(False, 4).Set(Vt.FloatArray.FromNumpy(weight[used].reshape(-1).astype(np.float32)))
        UsdShade.MaterialBindingAPI.Apply(geometry.GetPrim()).Bind(material)
    for k, ball in enumerate(small().eyeballs):
        geometry = UsdGeom.Mesh.Define(stage, f"/World/Figur/eye_{'LR'[k]}")
        geometry.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(ball.vertices))
        geometry.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(ball.triangles), 3, np.int32)))
        geometry.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(ball.triangles.reshape(-1).astype(np.int32)))
        geometry.CreateDisplayColorAttr([(0.2, 0.4, 0.6)])
    stage.SetDefaultPrim(root.GetPrim())
    stage.GetRootLayer().Save()
    return path


@pytest.mark.parametrize(("unit", "z_up"), [(0.01, True), (1.0, False), (0.01, False), (None, None)])
def test_usd_of_others_stands_where_she_stands(tmp_path: Path, unit: float | None, z_up: bool | None) -> None:
    Image.fromarray(small().albedo).save(tmp_path / "skin.png")
    source = read_source(_usd(tmp_path / "a.usdc", unit=unit, z_up=z_up, names=lambda j: "mixamorig_" + _mixamo(JOINTS[j])))
    assert set(source.groups) == {"Kopf", "Koerper", "eye_L", "eye_R"}
    _stands(source)
    assert source.rig is not None
    assert source.rig.weight is not None
    assert any(m.picture is not None for m in source.materials)
    assert any(m.colour is not None for m in source.materials)
    head = mapped(source.rig).joint_of_column
    kopf = np.unique(source.triangles[source.group == source.groups.index("Kopf")])
    column = next(c for c, name in head.items() if name == "head")
    assert source.rig.weight[kopf, column].mean() > 0.7


def _mixamo(joint: str) -> str:
    side, _, rest = joint.partition("_")
    known = {"upper_arm": "Arm", "lower_arm": "ForeArm", "upper_leg": "UpLeg", "lower_leg": "Leg", "toes": "ToeBase"}
    if side in ("left", "right"):
        words = rest.split("_")
        numbers = {"metacarpal": "1", "proximal": "2" if "thumb" in rest else "1", "intermediate": "2", "distal": "3"}
        name = known.get(rest) or ("Hand" + words[0].capitalize() + numbers[words[1]] if len(words) == 2 else rest.capitalize())
        return side.capitalize() + name.replace("Little", "Pinky")
    return joint.capitalize().replace("_", "")


def test_usd_with_unknown_names_and_without_its_texture_works(tmp_path: Path) -> None:
    source = read_source(_usd(tmp_path / "a.usda", unit=0.01, z_up=True, names=lambda j: f"K{j:03d}"))
    assert any("skin.png" in note for note in source.notes)
    made = make_avatar(source, name="eva")
    assert made.weights_from == "rig"
    assert "by position" in made.skeleton_from
    assert len(made.avatar.eyeballs) == 2
    hand = JOINT_INDEX["left_hand"]
    np.testing.assert_allclose(made.avatar.skeleton.rest[hand], small().skeleton.rest[hand], atol=0.02)


def test_usd_that_holds_nobody_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.usda"
    for text, what in (
        ("", "not a whole USD"),
        ("garbage", "not a whole USD"),
        ('#usda 1.0\ndef Xform "A"\n{\n}\n', "no meshes"),
        (
            '#usda 1.0\ndef Mesh "A"\n{\nint[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 9]\n'
            "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}\n",
            "not there",
        ),
    ):
        path.write_text(text)
        with pytest.raises(MakingError, match=what) as refused:
            read_source(path)
        assert "\n" not in str(refused.value)

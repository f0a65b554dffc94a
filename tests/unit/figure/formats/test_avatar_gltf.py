"""Avatars in glTF and VRM: nothing is lost, the formats' rules are kept, another reader sees the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from avatar_fixture import same
from gltf_fixture import chunks, foreign, near, small, write_glb
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from making_fixture import person
from scipy.spatial import KDTree

from vistel.figure.avatar.avatar import Avatar, Target
from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.formats.gltf import save_gltf
from vistel.figure.formats.load import load_any
from vistel.figure.formats.vrm import PRESETS
from vistel.figure.making.files.read import read_source
from vistel.figure.making.files.vrm import REQUIRED, house_name, vrm_name
from vistel.figure.making.make import make_avatar
from vistel.figure.making.source import MakingError
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.rigid.weights import joints_only
from vistel.figure.skeleton import JOINT_INDEX, JOINTS

_PARENTS = {
    "spine": "hips", "chest": "spine", "upperChest": "chest", "neck": "upperChest", "head": "neck", "leftEye": "head",
    "jaw": "head", "leftUpperLeg": "hips", "leftLowerLeg": "leftUpperLeg", "leftFoot": "leftLowerLeg", "leftToes": "leftFoot",
    "leftShoulder": "upperChest", "leftUpperArm": "leftShoulder", "leftLowerArm": "leftUpperArm", "leftHand": "leftLowerArm",
    "leftThumbMetacarpal": "leftHand", "leftIndexProximal": "leftHand", "leftIndexDistal": "leftIndexIntermediate",
}  # fmt: skip
"""What VRM 1.0 says each bone hangs on, at any distance."""


@pytest.mark.parametrize(("ending", "make"), [(".glb", person), (".glb", small), (".vrm", small)])
def test_a_round_trip_loses_nothing_of_the_finest_level_but_what_jpeg_does(tmp_path: Path, ending: str, make: Any) -> None:
    path = tmp_path / f"eva{ending}"
    save_gltf(make(), path)
    again = load_any(path)
    near(again.albedo, make().albedo)
    same(replace(make(), coarser=()), replace(again, coarser=(), albedo=make().albedo))
    assert [len(level.mesh.triangles) for level in again.coarser] == [6000, 2600]


def test_without_what_only_vistel_reads_it_comes_back_the_same_within_millimetres(tmp_path: Path) -> None:
    made = make_avatar(read_source(foreign(tmp_path)), name="eva")
    avatar, before = made.avatar, small()
    assert made.weights_from == "rig"
    assert made.unknown == ()
    distance, nearest = KDTree(before.mesh.vertices).query(avatar.mesh.vertices)
    assert len(avatar.mesh.vertices) == len(before.mesh.vertices)
    assert len(avatar.mesh.triangles) == len(before.mesh.triangles)
    assert distance.max() < 0.006
    assert np.linalg.norm(avatar.skeleton.rest - before.skeleton.rest, axis=1).max() < 0.006
    limbs = np.abs(_limbs(avatar) - _limbs(before)[nearest])
    # A file's weights are softened where they go over from limb to limb.
    assert limbs.mean() < 0.02
    assert np.percentile(limbs, 99) < 0.2


def _shares(avatar: Avatar) -> np.ndarray:
    """(V, J) of joints."""
    assert avatar.mesh.bone is not None
    assert avatar.mesh.weight is not None
    joint, share = joints_only(avatar.mesh.bone, avatar.mesh.weight)
    out = np.zeros((len(joint), len(JOINTS)))
    np.add.at(out, (np.arange(len(joint))[:, None], joint), share)
    return out


def _limbs(avatar: Avatar) -> np.ndarray:
    """(V, 2) shares of what is above and below each elbow."""
    names = (("left_upper_arm", "right_upper_arm"), ("left_lower_arm", "right_lower_arm"))
    return np.column_stack([_shares(avatar)[:, [JOINT_INDEX[n] for n in pair]].sum(axis=1) for pair in names])


@pytest.mark.parametrize("ending", [".glb", ".vrm"])
def test_numbers_are_as_gltf_wants_them(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"eva{ending}"
    save_gltf(small(), path)
    tree, binary = chunks(path)
    sizes = {5121: 1, 5123: 2, 5125: 4, 5126: 4}
    columns = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
    for row in tree["accessors"]:
        view = tree["bufferViews"][row["bufferView"]]
        assert not row.get("normalized") or row["componentType"] == 5123
        assert view["byteOffset"] % 4 == 0
        assert view["byteLength"] == row["count"] * columns[row["type"]] * sizes[row["componentType"]]
        assert view["byteOffset"] + view["byteLength"] <= tree["buffers"][0]["byteLength"] <= len(binary)
    for mesh in tree["meshes"]:
        attributes = mesh["primitives"][0]["attributes"]
        assert len({tree["accessors"][a]["count"] for a in attributes.values()}) == 1
        assert {"min", "max"} <= tree["accessors"][attributes["POSITION"]].keys()
    source = read_source(path)
    assert source.rig is not None
    assert source.rig.weight is not None
    np.testing.assert_allclose(source.rig.weight.sum(axis=1), 1.0, atol=1e-5)


def test_a_vrm_file_has_all_that_vrm_1_requires(tmp_path: Path) -> None:
    path = tmp_path / "eva.vrm"
    save_gltf(small(), path, author="Eva Ito")
    tree, _ = chunks(path)
    vrm = tree["extensions"]["VRMC_vrm"]
    assert "VRMC_vrm" in tree["extensionsUsed"]
    assert vrm["specVersion"] == "1.0"
    assert vrm["meta"]["authors"] == ["Eva Ito"]
    assert vrm["meta"]["licenseUrl"] == "https://vrm.dev/licenses/1.0/"
    bones = {name: bone["node"] for name, bone in vrm["humanoid"]["humanBones"].items()}
    assert set(REQUIRED) <= set(bones)
    assert len(set(bones.values())) == len(bones)
    parent = {c: k for k, node in enumerate(tree["nodes"]) for c in node.get("children", [])}

    def above(node: int) -> list[int]:
        return [parent[node], *above(parent[node])] if node in parent else []

    for bone, on in _PARENTS.items():
        assert bones[on] in above(bones[bone]), bone
    for node in bones.values():
        assert "rotation" not in tree["nodes"][node]


def test_vrm_names_lead_there_and_back() -> None:
    for joint in JOINTS:
        bone = vrm_name(joint)
        if bone is not None:
            assert house_name(bone) in (joint, "spine")
    assert vrm_name("left_thumb_metacarpal") == "leftThumbMetacarpal"
    assert vrm_name("spine_2") is None
    assert house_name("tail") is None


def test_another_reader_sees_the_same_mesh_and_texture(tmp_path: Path) -> None:
    path = tmp_path / "eva.glb"
    avatar = small()
    save_gltf(avatar, path)
    scene = trimesh.load(path, process=False)
    skin = scene.geometry["skin"]
    np.testing.assert_array_equal(skin.vertices, avatar.mesh.vertices[avatar.mesh.corner_vertex])
    np.testing.assert_array_equal(skin.faces, avatar.mesh.corner_triangles)
    np.testing.assert_allclose(skin.visual.uv, avatar.mesh.uv, atol=1e-6)
    near(np.asarray(skin.visual.material.baseColorTexture.convert("RGB")), avatar.albedo)
    assert set(scene.geometry) == {"skin", "left_eye", "right_eye"}


def test_a_file_that_others_changed_is_imported_anew(tmp_path: Path) -> None:
    path = tmp_path / "eva.glb"
    save_gltf(small(), path)
    tree, binary = chunks(path)
    tree["meshes"][0]["name"] = "Body.001"
    with pytest.raises(AvatarFileError, match="vistel avatar import"):
        load_any(write_glb(path, tree, binary))
    assert read_source(path).rig is not None


def _moved(*names: str) -> Avatar:
    """Her with targets that each move some vertices of her face by centimetres, the last one none."""
    draw = np.random.default_rng(7)

    def target(name: str) -> Target:
        vertex = np.sort(draw.choice(len(small().mesh.vertices), 0 if name == names[-1] else 40, replace=False)).astype(np.int32)
        return Target(name, vertex, draw.normal(0.0, 0.01, (len(vertex), 3)).astype(np.float32))

    return replace(small(), mesh=replace(small().mesh, targets=tuple(map(target, names))))


def test_targets_are_stored_where_they_move_something(tmp_path: Path) -> None:
    her, path = _moved("jawOpen", "mouthPucker", "nothing"), tmp_path / "eva.glb"
    save_gltf(her, path)
    same(her.mesh.targets, load_any(path).mesh.targets)
    tree, binary = chunks(path)
    rows = [tree["accessors"][t["POSITION"]] for t in tree["meshes"][0]["primitives"][0]["targets"]]
    for row, target in zip(rows, her.mesh.targets, strict=True):
        sparse = row["sparse"]
        views = [tree["bufferViews"][sparse[part]["bufferView"]] for part in ("indices", "values")]
        at, by = (binary[v["byteOffset"] : v["byteOffset"] + v["byteLength"]] for v in views)
        index = np.frombuffer(at, {5123: np.uint16, 5125: np.uint32}[sparse["indices"]["componentType"]])
        assert len(index) == sparse["count"] >= 1
        assert (np.diff(index.astype(int)) > 0).all()
        assert index.max() < row["count"] == len(her.mesh.corner_vertex)
        whole = np.zeros((row["count"], 3), np.float32)
        whole[index] = np.frombuffer(by, np.float32).reshape(-1, 3)
        assert (row["min"], row["max"]) == (whole.min(axis=0).tolist(), whole.max(axis=0).tolist())
        assert set(her.mesh.corner_vertex[whole.any(axis=1)]) == set(target.vertex)


def test_a_vrm_has_expressions_of_its_targets_which_are_read_again(tmp_path: Path) -> None:
    her = _moved("eyeBlinkLeft", "eyeBlinkRight", "mouthSmileLeft", "mouthSmileRight", "jawOpen", "tongueOut")
    path = foreign(tmp_path, ending=".vrm", avatar=her)
    tree, _ = chunks(path)
    told = tree["extensions"]["VRMC_vrm"]["expressions"]
    assert {"aa", "blink", "blinkLeft", "blinkRight", "happy", "surprised"} <= set(told["preset"]) <= set(PRESETS)
    assert set(told["custom"]) == {t.name for t in her.mesh.targets}
    bound = [b for group in told.values() for row in group.values() for b in row["morphTargetBinds"]]
    assert {tree["nodes"][b["node"]]["name"] for b in bound} == {"skin"}
    assert {b["index"] for b in bound} == set(range(6))
    assert all(0.0 < b["weight"] <= 1.0 for b in bound)
    assert [b["index"] for b in told["preset"]["blinkLeft"]["morphTargetBinds"]] == [0]
    read = {t.name: t for t in read_source(path).targets}
    assert {t.name for t in her.mesh.targets[:-1]} <= read.keys()
    assert "vrm:jawOpen" not in read
    blink = np.concatenate([read["eyeBlinkLeft"].vertex, read["eyeBlinkRight"].vertex])
    assert set(read["vrm:blink"].vertex) == set(blink)


@pytest.mark.parametrize(("names", "winks"), [((), None), (("eyeBlink", "nothing"), False), (("eyeBlinkLeft", "nothing"), True)])
def test_a_vrm_has_no_expression_that_nothing_shows(tmp_path: Path, names: tuple[str, ...], winks: bool | None) -> None:
    path = tmp_path / "eva.vrm"
    save_gltf(_moved(*names), path)
    told = chunks(path)[0]["extensions"]["VRMC_vrm"].get("expressions")
    assert (None if told is None else "blinkLeft" in told["preset"]) == winks


def test_a_built_in_person_is_a_small_file(tmp_path: Path) -> None:
    path = tmp_path / "grace.vrm"
    save_gltf(builtin_avatar("builtin:person=grace", name="grace", height=1.63), path)
    assert path.stat().st_size < 4_000_000
    told = chunks(path)[0]["extensions"]["VRMC_vrm"]["expressions"]
    assert set(told["preset"]) == set(PRESETS)
    assert len(told["custom"]) == 52


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.floats(0.0, 1.0), put=st.binary(min_size=1, max_size=8), cut=st.booleans())
def test_damaged_files_are_refused_in_one_line_or_read(tmp_path: Path, at: float, put: bytes, cut: bool) -> None:
    path = tmp_path / "eva.glb"
    if not (tmp_path / "whole.glb").exists():
        save_gltf(replace(small(), albedo=small().albedo[::16, ::16]), tmp_path / "whole.glb")
    whole = (tmp_path / "whole.glb").read_bytes()
    k = int(at * len(whole))
    path.write_bytes(whole[:k] if cut else whole[:k] + put + whole[k + len(put) :])
    for read, refusal in ((load_any, AvatarFileError), (read_source, MakingError)):
        try:
            read(path)
        except refusal as refused:
            assert "\n" not in str(refused)
            assert str(path) in str(refused)

"""Expressions that files bring: their names, their way from the file to the mesh, and a face that is moved by them."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_fixture import chunks, foreign, small, write_glb

from vistel.figure.avatar.avatar import Avatar, Target
from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.face.landmarks import landmarks_of
from vistel.figure.face.rules import builtin_rules
from vistel.figure.face.shape import Expression
from vistel.figure.face.skin import FaceSkin
from vistel.figure.face.targets import Meaning, meant
from vistel.figure.formats.avatar_file import load_avatar, save_avatar
from vistel.figure.formats.gltf import save_gltf
from vistel.figure.formats.gltf_read import load_gltf
from vistel.figure.formats.usd import load_usd, save_usd
from vistel.figure.making.files.read import Extras, read_source
from vistel.figure.making.make import make_avatar
from vistel.figure.making.source import MakingError

RULES = builtin_rules()


@pytest.mark.parametrize(
    ("name", "unit", "side"),
    [
        ("mouthSmileLeft", "AU12", 1),
        ("mouthSmile_R", "AU12", -1),
        ("Face.browInnerUp", "AU1", 0),
        ("jawLeft", "AU30", 0),
        ("eye-left-closure", "AU45", 1),
        ("mouth-corner-puller", "AU12", 0),
        ("eyebrows-right-inner-up", "AU1", -1),
        ("AU26", "AU26", 0),
        ("AU4_L", "AU4", 1),
        ("left_AU2", "AU2", 1),
        ("vrm:aa", "AU26", 0),
        ("vrm:blinkRight", "AU45", -1),
        ("vrm:MouthSmileLeft", "AU12", 1),
        ("Lip Corner Puller.l", "AU12", 1),
        ("tongueOut", None, 0),
        ("Body_fat", None, 0),
        ("", None, 0),
        ("vrm:neutral", None, 0),
    ],
)
def test_names_of_many_programs_mean_units(name: str, unit: str | None, side: int) -> None:
    found = meant([name]).get(name)
    assert (found is None) if unit is None else found is not None and (found.unit, found.side) == (unit, side)
    assert found is None or isinstance(found, Meaning)


def with_targets(path: Path, told: dict[str, tuple[float, float, float]], extra: dict[str, Any] | None = None) -> Path:
    """A GLB whose skin has a morph target for each name, in which the head's front moves so far."""
    tree, binary = chunks(path)
    primitive = tree["meshes"][0]["primitives"][0]
    place = tree["accessors"][primitive["attributes"]["POSITION"]]
    view = tree["bufferViews"][place["bufferView"]]
    points = np.frombuffer(binary, np.float32, 3 * place["count"], view.get("byteOffset", 0)).reshape(-1, 3)
    front = (points[:, 1] > 1.45) & (points[:, 2] > 0.03)
    primitive["targets"] = []
    for move in told.values():
        offset = np.where(front[:, None], np.array(move, np.float32), np.float32(0.0)).astype(np.float32)
        tree["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": offset.nbytes})
        binary += offset.tobytes()
        tree["accessors"].append(
            {"bufferView": len(tree["bufferViews"]) - 1, "componentType": 5126, "count": len(offset), "type": "VEC3"}
        )
        primitive["targets"].append({"POSITION": len(tree["accessors"]) - 1})
    tree["meshes"][0]["extras"] = {"targetNames": list(told)}
    tree["buffers"][0]["byteLength"] = len(binary)
    tree.setdefault("extensions", {}).update(extra or {})
    return write_glb(path, tree, binary)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Avatar, tuple[str, ...]]:
    folder = tmp_path_factory.mktemp("targets")
    moves = {
        "jawOpen": (0.0, -0.02, 0.0),
        "mouthSmile": (0.0, 0.01, 0.0),
        "eyeBlinkLeft": (0.0, 0.0, 0.003),
        "Antenna": (0.1, 0.0, 0.0),
        "Fcl_U": (0.0, 0.0, 0.008),
    }
    vrm = {
        "VRMC_vrm": {
            "specVersion": "1.0",
            "expressions": {
                "preset": {
                    "ou": {"morphTargetBinds": [{"node": 60, "index": 4, "weight": 0.5}]},
                    "aa": {"morphTargetBinds": [{"node": 60, "index": 3, "weight": 1.0}]},
                }
            },
        }
    }
    out = make_avatar(read_source(with_targets(foreign(folder), moves, vrm)), name="theirs", height=1.70)
    return out.avatar, out.notes


def moved(avatar: Avatar, e: Expression, level: int = 0) -> np.ndarray:
    mesh = (avatar, *avatar.coarser)[level].mesh
    vertices, normals = mesh.vertices.copy(), np.zeros_like(mesh.vertices)
    FaceSkin(mesh, landmarks_of(avatar)).lay(vertices, normals, np.eye(3), e)
    return vertices - mesh.vertices


def doing(**strength: float) -> Expression:
    out = np.zeros(len(RULES.units))
    for name, value in strength.items():
        out[RULES.names.index(name)] = value
    return Expression(out)


def test_a_files_own_shapes_move_its_face_and_rules_do_the_rest(made: tuple[Avatar, tuple[str, ...]]) -> None:
    avatar, notes = made
    assert {t.name for t in avatar.mesh.targets} == {"jawOpen", "mouthSmile", "eyeBlinkLeft", "vrm:ou", "vrm:aa"}
    assert any("5 targets of expressions drive its face; 2 whose names say nothing left out (Antenna, Fcl_U)" in n for n in notes)
    for level in range(1 + len(avatar.coarser)):
        mesh = (avatar, *avatar.coarser)[level].mesh
        front = (mesh.vertices[:, 1] > 1.52) & (mesh.vertices[:, 2] > 0.06) & (mesh.vertices[:, 1] < 1.66)
        half = moved(avatar, doing(AU26=0.5), level)[front]
        assert np.abs(half - (0.0, -0.01, 0.0)).max() < 1e-3  # jawOpen before VRM's aa
        pucker = moved(avatar, doing(AU18=1.0), level)[front]
        assert np.abs(pucker - (0.0, 0.0, 0.004)).max() < 1e-3
    left = moved(avatar, doing(left_AU12=1.0))
    x = avatar.mesh.vertices[:, 0]
    assert np.abs(left[x < -0.015]).max() < 1e-6
    assert left[(x > 0.015), 1].max() == pytest.approx(0.01, abs=1e-3)
    brow = moved(avatar, doing(left_AU1=1.0))
    assert 0.004 < brow[:, 1].max() < 0.012
    wink = moved(avatar, Expression(np.zeros(len(RULES.units)), None, (0.0, 1.0)))
    assert wink[:, 2].max() == pytest.approx(0.003, abs=5e-4)


def test_targets_are_kept_in_files(made: tuple[Avatar, tuple[str, ...]], tmp_path: Path) -> None:
    avatar, _ = made
    save_avatar(avatar, tmp_path / "me.npz")
    save_usd(avatar, tmp_path / "me.usda")
    save_gltf(avatar, tmp_path / "me.glb")
    exported = load_gltf(tmp_path / "me.glb")
    assert exported is not None
    for a, b in zip(avatar.mesh.targets, exported.mesh.targets, strict=True):
        assert a.name == b.name
        still = np.abs(a.offset).max(axis=1) == 0.0
        assert np.array_equal(a.vertex[~still], b.vertex)
        assert np.allclose(a.offset[~still], b.offset, atol=1e-7)
    for again in (load_avatar(tmp_path / "me.npz"), load_usd(tmp_path / "me.usda")):
        for level, kept in zip((avatar, *avatar.coarser), (again, *again.coarser), strict=True):
            assert [t.name for t in kept.mesh.targets] == [t.name for t in level.mesh.targets]
            for a, b in zip(level.mesh.targets, kept.mesh.targets, strict=True):
                assert np.array_equal(a.vertex, b.vertex)
                assert np.allclose(a.offset, b.offset, atol=1e-7)


def test_a_target_of_vertices_that_are_not_there_is_refused(made: tuple[Avatar, tuple[str, ...]], tmp_path: Path) -> None:
    avatar, _ = made
    wild = Target("jawOpen", np.array([10**6], np.int32), np.zeros((1, 3), np.float32))
    save_usd(replace(avatar, mesh=replace(avatar.mesh, targets=(wild,)), coarser=()), tmp_path / "wild.usda")
    with pytest.raises(AvatarFileError, match="target 'jawOpen' moves what is not there"):
        load_usd(tmp_path / "wild.usda")


def test_morph_targets_of_another_mesh_are_reported_in_a_line(tmp_path: Path) -> None:
    def change(tree: dict[str, Any]) -> None:
        tree["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": tree["meshes"][1]["primitives"][0]["attributes"]["POSITION"]}]

    with pytest.raises(MakingError, match="a morph target of other vertices than its mesh"):
        read_source(foreign(tmp_path, change))


def test_makehumans_expression_units_are_read_from_a_folder(tmp_path: Path) -> None:
    mesh = small().mesh
    body = "\n".join(f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices.tolist())
    faces = "\n".join("f {} {} {}".format(*row) for row in (mesh.triangles + 1).tolist())
    (tmp_path / "her.obj").write_text(f"{body}\n{faces}\n")
    folder = tmp_path / "units"
    folder.mkdir()
    with pytest.raises(MakingError, match=r"no \.target"):
        read_source(tmp_path / "her.obj", Extras(expressions=folder))
    (folder / "eye-left-closure.target.gz").write_bytes(gzip.compress(b"# basis\n7 0 -0.01 0\n"))
    (folder / "mouth-open.target").write_text("3 0 -0.02 0.001\n")
    source = read_source(tmp_path / "her.obj", Extras(expressions=folder))
    assert {t.name: (t.vertex.tolist(), t.offset.round(4).tolist()) for t in source.targets} == {
        "eye-left-closure": ([7], [[0.0, -0.01, 0.0]]),
        "mouth-open": ([3], [[0.0, -0.02, 0.001]]),
    }
    (folder / "mouth-open.target").write_text("999999 0 0 0\n")
    with pytest.raises(MakingError, match="not a line of a morph target"):
        read_source(tmp_path / "her.obj", Extras(expressions=folder))


def test_makehumans_own_units_move_its_face(shared_data: Path) -> None:
    folder = shared_data / "human" / "makehuman"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    units = folder / "targets" / "expression"
    extras = Extras(rig=folder / "rig.game_engine.json", weights=folder / "weights.game_engine.json.gz", expressions=units)
    source = read_source(folder / "base.obj", extras)
    avatar = make_avatar(source, name="makehuman").avatar
    assert len(avatar.mesh.targets) >= 14
    p, chin = avatar.mesh.vertices, landmarks_of(avatar).marks[12]
    near = np.linalg.norm(p - chin, axis=1) < 0.012
    assert near.any()
    assert moved(avatar, doing(AU26=1.0))[near, 1].mean() < -0.004
    lid = moved(avatar, Expression(np.zeros(len(RULES.units)), None, (0.0, 1.0)))
    assert lid[:, 1].min() < -0.004
    assert np.abs(lid[p[:, 0] < -0.004]).max() < 1e-4

"""People's meshes become avatars: whatever unit, axes, pose and faults they come with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from making_fixture import a_pose, person, write_obj
from PIL import Image

from vistel.figure.figure import Figure
from vistel.figure.making.files.read import Extras, read_source
from vistel.figure.making.levels import cut_apart, with_coarser
from vistel.figure.making.make import Making, make_avatar, refit
from vistel.figure.making.names import house_joint
from vistel.figure.making.parts import soundness
from vistel.figure.making.source import MakingError
from vistel.figure.posture.posture import Posture
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINT_INDEX

MAKEHUMAN = "human/makehuman"


def _made(path: Path, extras: Extras | None = None, **options: object) -> Making:
    return make_avatar(read_source(path, extras), name="eva", **options)  # type: ignore[arg-type]


def _joint(made: Making, name: str) -> np.ndarray:
    return made.avatar.skeleton.rest[JOINT_INDEX[name]]


def test_a_t_pose_in_metres_gets_joints_near_those_it_was_made_with(tmp_path: Path) -> None:
    made = _made(write_obj(tmp_path / "a.obj", person().mesh.vertices))
    for joint in ("lower_arm", "hand", "upper_leg", "lower_leg", "foot", "upper_arm"):
        for side in ("left", "right"):
            name = f"{side}_{joint}"
            assert np.linalg.norm(_joint(made, name) - person().skeleton.rest[JOINT_INDEX[name]]) < 0.06, name
    assert abs(made.pose_angle) < 0.15
    assert made.fit.mean_distance < 0.008


def test_centimetres_and_z_up_are_found_and_reported(tmp_path: Path) -> None:
    p = person().mesh.vertices
    made = _made(write_obj(tmp_path / "a.obj", 100.0 * np.column_stack([p[:, 0], -p[:, 2], p[:, 1]])))
    assert any("centimetres" in note for note in made.notes)
    assert any("Z is up" in note for note in made.notes)
    assert made.avatar.skeleton.height == pytest.approx(1.70, abs=0.02)
    toes, ankle = _joint(made, "left_toes"), _joint(made, "left_foot")
    assert toes[2] > ankle[2]


def test_a_mesh_that_faces_away_is_turned(tmp_path: Path) -> None:
    made = _made(write_obj(tmp_path / "a.obj", person().mesh.vertices * (-1.0, 1.0, -1.0)))
    assert any("face +Z" in note for note in made.notes)
    assert _joint(made, "left_toes")[2] > _joint(made, "left_foot")[2]


def test_an_a_pose_is_bent_to_the_t_pose(tmp_path: Path) -> None:
    made = _made(write_obj(tmp_path / "a.obj", a_pose()))
    assert made.pose_angle == pytest.approx(np.pi / 4, abs=0.15)
    upper, hand = _joint(made, "left_upper_arm"), _joint(made, "left_hand")
    assert hand[0] - upper[0] > 0.4
    assert abs(hand[1] - upper[1]) < 1e-9
    # The mesh went with the joints: nothing of it is below the hands out there.
    far = made.avatar.mesh.vertices[:, 0] > hand[0]
    assert np.abs(made.avatar.mesh.vertices[far, 1] - hand[1]).max() < 0.15


def test_holes_stay_and_are_reported(tmp_path: Path) -> None:
    keep = np.flatnonzero(np.arange(len(person().mesh.triangles)) % 400 != 0)
    made = _made(write_obj(tmp_path / "a.obj", person().mesh.vertices, faces=keep))
    assert made.sound.holes > 10
    assert any("holes" in note for note in made.notes)
    assert np.isfinite(Figure(made.avatar).pose(standard_postures()["sitting"]).vertices).all()


def test_a_mesh_that_is_not_manifold_works_and_has_its_levels_of_detail(tmp_path: Path) -> None:
    a, b, _ = (person().mesh.triangles[0] + 1).tolist()
    path = write_obj(tmp_path / "a.obj", person().mesh.vertices)
    path.write_text(path.read_text() + f"v 0 1 0.12\nf {a} {b} -1\n")
    made = _made(path)
    assert made.sound.branching > 0
    assert [len(level.mesh.triangles) <= n for level, n in zip(made.avatar.coarser, (6000, 2600), strict=True)] == [True, True]
    assert np.isfinite(Figure(made.avatar.coarser[1]).pose(standard_postures()["sitting"]).vertices).all()
    assert any("not manifold" in note for note in made.notes)


def test_a_hand_that_is_a_piece_apart_is_found_on_its_arm(tmp_path: Path) -> None:
    mesh, wrist = person().mesh, person().skeleton.rest[JOINT_INDEX["left_hand"], 0]
    hand = np.abs(mesh.vertices[mesh.triangles, 0]).max(axis=1) > wrist
    cut = np.abs(mesh.vertices[mesh.triangles, 0]).min(axis=1) < wrist
    made = _made(write_obj(tmp_path / "a.obj", mesh.vertices, faces=np.flatnonzero(~(hand & cut))))
    assert made.sound.pieces == 3
    for name in ("left_hand", "right_lower_arm"):
        assert np.linalg.norm(_joint(made, name) - person().skeleton.rest[JOINT_INDEX[name]]) < 0.06, name


def test_every_level_of_detail_is_there_for_a_mesh_of_few_triangles() -> None:
    few = with_coarser(replace(person().coarser[1], coarser=()))
    assert [len(level.mesh.triangles) for level in few.coarser] == [2600, 2600]
    assert few.coarser[0].mesh is few.mesh


def test_cut_apart_only_where_more_than_two_faces_meet() -> None:
    mesh = person().coarser[1].mesh
    same = cut_apart(mesh)
    assert len(same.vertices) == len(mesh.vertices)
    np.testing.assert_array_equal(same.vertices[same.triangles], mesh.vertices[mesh.triangles])
    fin = np.array([[*mesh.triangles[0, :2], mesh.triangles[900, 2]]], np.int32)
    corner = np.array([[*mesh.corner_triangles[0, :2], mesh.corner_triangles[900, 2]]], np.int32)
    odd = replace(mesh, triangles=np.vstack([mesh.triangles, fin]), corner_triangles=np.vstack([mesh.corner_triangles, corner]))
    assert not soundness(odd.triangles, len(odd.vertices)).manifold
    cut = cut_apart(odd)
    assert soundness(cut.triangles, len(cut.vertices)).manifold
    np.testing.assert_array_equal(cut.vertices[cut.triangles], odd.vertices[odd.triangles])
    np.testing.assert_array_equal(cut.uv[cut.corner_triangles], odd.uv[odd.corner_triangles])
    np.testing.assert_array_equal(cut.corner_vertex[cut.corner_triangles], cut.triangles)


def test_vertices_doubled_along_seams_are_welded(tmp_path: Path) -> None:
    mesh = person().mesh
    path = tmp_path / "a.obj"
    rows = mesh.vertices[mesh.corner_vertex]
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in rows.tolist()]
    lines += ["f {} {} {}".format(*t) for t in (mesh.corner_triangles + 1).tolist()]
    path.write_text("\n".join(lines))
    made = _made(path)
    assert len(made.avatar.mesh.vertices) == len(mesh.vertices)
    assert made.sound.border == 0


def test_without_texture_the_parts_of_the_body_get_plain_colours(tmp_path: Path) -> None:
    made = _made(write_obj(tmp_path / "a.obj", person().mesh.vertices))
    assert any("no texture" in note for note in made.notes)
    mesh, albedo = made.avatar.mesh, made.avatar.albedo
    uv = mesh.uv[mesh.corner_triangles].mean(axis=1)
    colour = albedo[((1 - uv[:, 1]) * albedo.shape[0]).astype(int), (uv[:, 0] * albedo.shape[1]).astype(int)]
    assert len(np.unique(colour, axis=0)) >= 3


def test_the_texture_of_its_material_stays_where_it_was(tmp_path: Path) -> None:
    Image.fromarray(person().albedo).resize((256, 256)).save(tmp_path / "skin.png")
    (tmp_path / "a.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    made = _made(write_obj(tmp_path / "a.obj", person().mesh.vertices, uv=True, extra="mtllib a.mtl\nusemtl skin"))
    assert made.avatar.albedo.shape == (256, 256, 3)
    corners = made.avatar.mesh.uv[made.avatar.mesh.corner_triangles]
    np.testing.assert_allclose(corners, person().mesh.uv[person().mesh.corner_triangles], atol=2e-6)


def test_a_texture_that_is_missing_is_reported_and_a_plain_colour_taken(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl skin\nKd 0.5 0.25 0.75\nmap_Kd gone.png\n")
    made = _made(write_obj(tmp_path / "a.obj", person().mesh.vertices, uv=True, extra="mtllib a.mtl\nusemtl skin"))
    assert any("gone.png" in note for note in made.notes)
    assert (made.avatar.albedo == (128, 64, 191)).all()


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "no faces"),
        ("v 0 0 0\nf 1 2 3\n", ":2:"),
        ("v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "fewer numbers"),
        ("v a b c\n", ":1:"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "expected at least"),
        ("f 1/1/1 2 3", ":1:"),
    ],
)
def test_files_that_hold_nobody_are_refused_in_one_line(tmp_path: Path, text: str, what: str) -> None:
    path = tmp_path / "a.obj"
    path.write_text(text)
    with pytest.raises(MakingError, match=what) as refused:
        _made(path)
    assert "\n" not in str(refused.value)


def test_what_is_no_standing_person_is_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    p = person().mesh.vertices
    for points in (rng.normal(size=p.shape), p * 1e6, p * (0.1, 1, 0.1)):
        with pytest.raises(MakingError):
            _made(write_obj(tmp_path / "a.obj", points))


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=400))
def test_garbage_for_a_mesh_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.obj"
    path.write_bytes(data)
    with pytest.raises(MakingError):
        _made(path)


@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(cut=st.floats(0.05, 0.999))
def test_a_mesh_cut_short_is_refused_or_works(tmp_path: Path, cut: float) -> None:
    whole = write_obj(tmp_path / "whole.obj", person().mesh.vertices).read_bytes()
    path = tmp_path / "a.obj"
    path.write_bytes(whole[: int(cut * len(whole))])
    try:
        read_source(path)
    except MakingError as refused:
        assert str(path) in str(refused)


@pytest.mark.parametrize(
    ("name", "ours"),
    [
        ("mixamorig:LeftForeArm", "left_lower_arm"),
        ("mixamorig_LeftHand", "left_hand"),
        ("upperarm_r", "right_upper_arm"),
        ("J_Bip_L_UpperLeg", "left_upper_leg"),
        ("thigh.L", "left_upper_leg"),
        ("LeftUpLeg", "left_upper_leg"),
        ("calf_l", "left_lower_leg"),
        ("Spine2", "spine"),
        ("mixamorig:RightHandIndex2", "right_index_intermediate"),
        ("thumb_01_l", "left_thumb_metacarpal"),
        ("rightLittleDistal", "right_little_distal"),
        ("LHipJoint", "spine"),
        ("Head", "head"),
        ("left_upper_arm", "left_upper_arm"),
        ("Bone.017", None),
        ("RThumb", "right_thumb_metacarpal"),
        ("clavicle_l", "left_shoulder"),
        ("finger2-1.L", "left_index_proximal"),
    ],
)
def test_names_of_other_rigs_are_understood(name: str, ours: str | None) -> None:
    assert house_joint(name) == ours


def test_more_primitives_hold_the_mesh_more_closely() -> None:
    means = [refit(person(), n)[1].mean_distance for n in (23, 55, 60)]
    assert means[0] > means[2]
    assert means[1] > means[2]
    with pytest.raises(ValueError, match="expected 23, or 55 to 200"):
        refit(person(), 30)


def test_soundness_counts_holes_and_branches() -> None:
    box = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 3]], np.int32)
    assert soundness(box, 4).holes == 1
    assert soundness(np.vstack([box, [[1, 2, 3]]]).astype(np.int32), 4).border == 0


def test_makehumans_base_mesh_becomes_a_person_within_the_limits(shared_data: Path) -> None:
    folder = shared_data / MAKEHUMAN
    extras = Extras(rig=folder / "rig.game_engine.json", weights=folder / "weights.game_engine.json.gz")
    made = _made(folder / "base.obj", extras)
    assert len(made.avatar.mesh.vertices) == 13380
    assert len(made.avatar.eyeballs) == 2
    assert made.weights_from == "rig"
    assert made.unknown == ("Root",)
    assert any("decimetres" in note for note in made.notes)
    assert made.avatar.skeleton.height == pytest.approx(1.67, abs=0.02)
    assert refit(made.avatar, 23)[1].mean_distance <= 0.008
    assert refit(made.avatar, 60)[1].mean_distance <= 0.004
    figure = Figure(made.avatar)
    moved = np.linalg.norm(figure.pose(Posture()).vertices - made.avatar.mesh.vertices, axis=1)
    assert moved.max() < 0.01
    # A joint chain that puts no limb where the mesh is not: hands stay in reach of the wrist in every posture.
    for posture in standard_postures().values():
        state = figure.pose(posture)
        assert np.isfinite(state.vertices).all()
        assert np.ptp(state.vertices, axis=0).max() < 2.4


def test_clothes_follow_the_body_under_them(shared_data: Path) -> None:
    folder = shared_data / MAKEHUMAN
    extras = Extras(
        rig=folder / "rig.cmu_mb.json",
        weights=folder / "weights.cmu_mb.json.gz",
        clothes=(folder / "clothes/male_casualsuit06/male_casualsuit06.mhclo",),
    )
    made = _made(folder / "base.obj", extras)
    assert made.sound.pieces > 1
    assert len(made.avatar.mesh.vertices) < 13380 + 3708
    mesh = made.avatar.mesh
    edges = mesh.vertices[mesh.triangles] - mesh.vertices[np.roll(mesh.triangles, 1, axis=1)]
    assert np.linalg.norm(edges, axis=2).max() < 0.12


def test_makehumans_files_that_are_damaged_are_refused(shared_data: Path, tmp_path: Path) -> None:
    folder = shared_data / MAKEHUMAN
    weights = tmp_path / "weights.json.gz"
    weights.write_bytes((folder / "weights.game_engine.json.gz").read_bytes()[:5000])
    for extras in (
        Extras(rig=folder / "rig.game_engine.json", weights=weights),
        Extras(rig=folder / "hm08_config.json"),
        Extras(rig=folder / "base.obj"),
        Extras(texture=folder / "base.obj"),
        Extras(texture=tmp_path / "gone.png"),
        Extras(targets=(f"{folder / 'base.obj'}",)),
        Extras(rig=tmp_path / "gone.json"),
    ):
        with pytest.raises(MakingError) as refused:
            read_source(folder / "base.obj", extras)
        assert "\n" not in str(refused.value)

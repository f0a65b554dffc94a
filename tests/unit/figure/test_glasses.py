"""Glasses: they sit on any head without cutting it, move with the head alone, are kept by files, and leave the face as it was."""

import os
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import vistel.figure
from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar, Mesh, clothes, flesh, rigid
from vistel.figure.avatar.check import check_avatar
from vistel.figure.avatar.patch import of_numbers, patch_of
from vistel.figure.body_model.assemble import assemble
from vistel.figure.body_model.model import body_model
from vistel.figure.body_model.person import drawn, fit
from vistel.figure.face.landmarks import landmarks_of
from vistel.figure.face.rules import builtin_rules
from vistel.figure.face.shape import Expression
from vistel.figure.face.skin import FaceSkin
from vistel.figure.figure import Figure
from vistel.figure.formats.avatar_file import load_avatar, save_avatar
from vistel.figure.formats.gltf import save_gltf
from vistel.figure.formats.load import load_any
from vistel.figure.formats.obj import export_obj
from vistel.figure.formats.usd import save_usd
from vistel.figure.glasses.glasses import GLASSES, glasses
from vistel.figure.making.assembly.piece import closest
from vistel.figure.part import Part, joined
from vistel.figure.posture.posture import pose_joints
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.normals import vertex_normals

KINDS = tuple(kind for kind, style in GLASSES.items() if style is not None)
HEADS = min(int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "12")), 1_000)
MOST_VERTICES = 350
TOUCHES_M = 0.003
"""How far a temple may press into the skin beside an ear [m]."""


@cache
def head(seed: int) -> Avatar:
    """Bald and bare."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return assemble(body_model(), fit(drawn(seed)).shape, name=str(seed))


@cache
def worn(seed: int, kind: str) -> Part:
    made = glasses(head(seed), kind)
    assert made is not None
    return made


@cache
def wearing(seed: int, kind: str) -> Avatar:
    return joined(head(seed), [worn(seed, kind)])


def depth(body: Avatar, p: F64) -> F64:
    """(N,) how deep places are within the skin of a head [m], negative outside."""
    mesh, eyes = body.mesh, body.skeleton.rest[JOINT_INDEX["left_eye"]]
    at, skin = mesh.vertices.astype(np.float64), body_model().levels[0].vertex < body_model().body
    closed = mesh.triangles[skin[mesh.triangles].all(axis=1)]  # not lashes, which have two sides
    tri = closed[(at[closed, 1] > eyes[1] - 0.12).all(axis=1)]
    on, share, far = closest(p, at[tri], 32)
    normal = np.einsum("nk,nki->ni", share, vertex_normals(at, closed)[tri[on]])
    nearest = np.einsum("nk,nki->ni", share, at[tri[on]])
    return far * -np.sign(((p - nearest) * normal).sum(axis=1))


def places(mesh: Mesh) -> F64:
    corner = mesh.vertices[mesh.triangles].astype(np.float64)
    share = np.array([(a, b, 4 - a - b) for a in range(5) for b in range(5 - a)]) / 4.0
    return np.einsum("kc,fcx->fkx", share, corner).reshape(-1, 3)


@pytest.mark.parametrize("seed", range(HEADS))
def test_fuzz_no_glasses_cut_a_head(seed: int) -> None:
    body = head(seed)
    p = places(worn(seed, KINDS[seed % len(KINDS)]).levels[0])
    eyes = body.skeleton.rest[JOINT_INDEX["left_eye"]]
    into, front = depth(body, p), p[:, 2] > eyes[2] + 0.005
    assert into[front].max() < 0.0
    assert into[~front].max() < TOUCHES_M


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_there_on_all_levels_and_within_its_vertices(kind: str) -> None:
    avatar, part = wearing(3, kind), worn(3, kind)
    check_avatar(avatar, kind)
    counts = [len(mesh.vertices) for mesh in part.levels]
    assert counts[0] <= MOST_VERTICES
    assert sorted(counts, reverse=True) == counts
    assert len(counts) == 1 + len(avatar.coarser)
    assert all(int(rigid(level).sum()) == count for level, count in zip((avatar, *avatar.coarser), counts, strict=True))


def test_they_go_from_before_the_eyes_to_behind_the_ears() -> None:
    body, p = head(5), worn(5, "rectangular").levels[0].vertices
    eyes = body.skeleton.rest[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]]
    assert 0.020 < p[:, 2].max() - eyes[0, 2] < 0.045
    assert p[:, 2].min() < eyes[0, 2] - 0.075
    for eye in eyes:
        near = p[np.abs(p[:, 0] - eye[0]) < 0.012]
        assert near[:, 1].max() > eye[1] + 0.006
        assert near[:, 1].min() < eye[1] - 0.006


def test_glasses_move_with_the_head_alone_whatever_the_skin_does() -> None:
    avatar = wearing(3, "round")
    mine, figure = rigid(avatar), Figure(avatar)
    rest, joint = avatar.mesh.vertices[mine].astype(np.float64), JOINT_INDEX["head"]
    hand = Figure(head(4))
    for name in ("bow", "turn", "sitting"):
        posture = standard_postures()[name]
        at = pose_joints(avatar.skeleton, posture)
        expected = (rest - avatar.skeleton.rest[joint]) @ at.rotation[joint].T + at.position[joint]
        np.testing.assert_allclose(figure.pose(posture).vertices[mine], expected, atol=1e-5)
        # Somebody stands in the same place: faces are pressed in, frames are not.
        pressed = hand.ghosts(hand.pose(posture).posed)
        np.testing.assert_allclose(figure.pose(posture, [pressed]).vertices[mine], expected, atol=1e-5)
    assert not (flesh(avatar) & mine).any()
    assert (clothes(avatar)[mine] <= 0).all()


def test_face_lids_and_gaze_are_as_without_glasses() -> None:
    bare, avatar, rules = head(6), wearing(6, "rectangular"), builtin_rules()
    assert np.array_equal(landmarks_of(bare).marks, landmarks_of(avatar).marks)
    without, with_them = (FaceSkin(a.mesh, landmarks_of(a), still=rigid(a)) for a in (bare, avatar))
    assert np.array_equal(without.vertex, with_them.vertex)
    smile = np.zeros(len(rules.units))
    smile[[k for k, u in enumerate(rules.units) if u.unit.name in ("AU1", "AU12")]] = 1.0
    for e in (Expression(smile), Expression(0.0 * smile, lids=(0.0, 0.3)), Expression(0.0 * smile, pitch=-0.4)):
        np.testing.assert_allclose(with_them.shape.offsets(e), without.shape.offsets(e), atol=1e-6)


@pytest.mark.parametrize("ending", ["npz", "usda", "glb", "vrm"])
def test_files_keep_them(ending: str, tmp_path: Path) -> None:
    avatar, path = wearing(3, "half_rim"), tmp_path / f"made.{ending}"
    save = {"npz": save_avatar, "usda": save_usd}.get(ending, save_gltf)
    save(avatar, path)
    read = load_avatar(path) if ending == "npz" else load_any(path)
    assert int(rigid(read).sum()) == int(rigid(avatar).sum())
    assert [p.film for p in read.patches] == [p.film for p in avatar.patches]


def test_an_obj_has_the_frame_and_no_lenses(tmp_path: Path) -> None:
    avatar, part = wearing(3, "round"), worn(3, "round")
    export_obj(avatar, tmp_path / "made.obj")
    faces = sum(line.startswith("f ") for line in (tmp_path / "made.obj").read_text("utf-8").splitlines())
    mesh = part.levels[0]
    lenses = int((patch_of(part.patches, mesh.uv, mesh.corner_triangles) == 1).sum())
    assert lenses > 0
    assert faces == sum(len(m.triangles) for m in (avatar.mesh, *avatar.eyeballs)) - lenses


def test_a_patch_of_an_older_file_is_not_rigid() -> None:
    lens = worn(3, "round").patches[1]
    assert lens.film
    assert of_numbers(lens.numbers, lens.pictures).rigid
    assert not of_numbers(lens.numbers[:12], lens.pictures).rigid
    with pytest.raises(ValueError, match="11 numbers, expected 14"):
        of_numbers(lens.numbers[:11], {})


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="glasses: expected one of none, round, rectangular, half_rim, got 'monocle'"):
        vistel.figure.person(glasses="monocle")

"""Wrinkles on a built-in figure: regions, dressed textures, outlines, what presses on them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from avatar_fixture import closed_person
from numpy.typing import NDArray
from scipy.spatial import KDTree

from vistel.figure.avatar.atlas_kernels import rasterise
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import ELBOW, KNEE, Posture, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.wrinkle.dressing import ChartedAvatar, dressed
from vistel.wrinkle.region import builtin_regions, sides_of, tube
from vistel.wrinkle.worn import Worn
from vistel.wrinkle.wrinkle_sets import wrinkle_sets


@pytest.fixture(scope="module")
def eva() -> ChartedAvatar:
    return dressed(closed_person(), ("sleeve",))


@pytest.fixture(scope="module")
def figure(eva: ChartedAvatar) -> Figure:
    return Figure(eva.avatar)


@pytest.fixture(scope="module")
def worn(eva: ChartedAvatar) -> Worn:
    return Worn(eva.avatar, [s for s in wrinkle_sets(["shirt"]) if s.region.name == "sleeve"], eva.charts)


def _bent(degrees: float) -> Posture:
    dofs = standing().dofs.copy()
    dofs[ELBOW["left"]] = math.radians(degrees)
    return Posture(dofs)


def _weights(worn: Worn, posture: Posture) -> NDArray[np.float64]:
    return worn.weights(pose_joints(worn.avatar.skeleton, posture))


@pytest.mark.parametrize("name", sorted(builtin_regions()))
def test_every_region_is_on_a_built_in_figure_and_unrolls(name: str, eva: ChartedAvatar) -> None:
    region = builtin_regions()[name]
    for side in sides_of(region):
        found = tube(eva.avatar, region, side)
        at = found.place(eva.avatar.mesh.vertices[found.member])
        finger = name.endswith("finger")
        assert found.member.sum() > (40 if finger else 100)
        assert (0.03 if finger else 0.2) < found.plane[0] < 1.5
        assert (0.03 if finger else 0.05) < found.plane[1] < 1.2
        assert ((at[:, 0] >= 0.0) & (at[:, 0] < 1.0)).all()
        assert np.ptp(at[:, 0]) > 0.9
        assert (found.attenuation[~found.member] == 0.0).all()


def test_the_elbow_is_in_the_middle_of_both_sleeves_and_its_crook_at_a_quarter(eva: ChartedAvatar) -> None:
    for side in ("left_", "right_"):
        found = tube(eva.avatar, builtin_regions()["sleeve"], side)
        elbow = eva.avatar.skeleton.rest[JOINT_INDEX[f"{side}lower_arm"]]
        ((u, v),) = found.place(elbow[None] + np.array((0.0, 0.0, 0.04)))
        assert (u, v) == pytest.approx((0.25, 0.5), abs=0.02)


def test_displacement_fades_to_nothing_where_the_region_ends(eva: ChartedAvatar) -> None:
    found = tube(eva.avatar, builtin_regions()["sleeve"], "left_")
    mesh = eva.avatar.mesh
    edges = np.concatenate((mesh.triangles[:, :2], mesh.triangles[:, 1:], mesh.triangles[:, [2, 0]]))
    beside = edges[found.member[edges[:, 0]] & ~found.member[edges[:, 1]], 0]
    assert len(beside) > 20
    assert found.attenuation[beside].max() == 0.0
    # Neighbours differ by no more than the way between them, over the fade, allows.
    way = np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1)
    rise = np.abs(found.attenuation[edges[:, 0]] - found.attenuation[edges[:, 1]])
    assert (rise <= 1.55 * way / (found.region.fade * 1.70 / 1.75) + 1e-6).all()


def test_a_dressed_avatar_looks_as_it_did(eva: ChartedAvatar) -> None:
    plain = closed_person()
    for mesh, albedo, other, its in (
        (plain.mesh, plain.albedo, eva.avatar.mesh, eva.avatar.albedo),
        (plain.coarser[0].mesh, plain.coarser[0].albedo, eva.avatar.coarser[0].mesh, eva.avatar.coarser[0].albedo),
    ):
        assert np.array_equal(mesh.triangles, other.triangles)
        assert np.array_equal(other.corner_vertex[other.corner_triangles], other.triangles)
        assert other.uv.min() >= 0.0
        assert other.uv.max() <= 1.0
        before, after = _colours(mesh.uv[mesh.corner_triangles], albedo), _colours(other.uv[other.corner_triangles], its)
        apart = np.abs(before - after).mean(axis=1)
        assert np.median(apart) < 6.0
        assert np.quantile(apart, 0.97) < 45.0


def _colours(uv: NDArray[np.float32], albedo: NDArray[np.uint8]) -> NDArray[np.float64]:
    middle = uv.mean(axis=1)
    h, w = albedo.shape[:2]
    return albedo[((1.0 - middle[:, 1]) * h).astype(int), (middle[:, 0] * w).astype(int)].astype(np.float64)


def test_on_every_level_triangles_lie_on_one_chart_or_on_none(eva: ChartedAvatar) -> None:
    for level in (eva.avatar, *eva.avatar.coarser):
        for chart in eva.charts:
            inside = np.zeros(len(level.mesh.uv), np.bool_)
            inside[chart.drawn(level.mesh)] = True
            corners = inside[level.mesh.corner_triangles]
            assert corners.any()
            assert (corners.all(axis=1) == corners.any(axis=1)).all()


def test_cloth_lies_still_where_its_chart_ends(worn: Worn, eva: ChartedAvatar) -> None:
    mesh = eva.avatar.mesh
    moved = worn.coordinates(np.ones(len(worn.sets))) - mesh.uv
    on_a_chart = np.zeros(len(mesh.uv), np.bool_)
    for chart in eva.charts:
        on_a_chart[chart.drawn(mesh)] = True
    edge = np.isin(mesh.corner_vertex, mesh.corner_vertex[~on_a_chart])
    assert np.abs(moved).max() > 0.005
    assert np.abs(moved[edge]).max() == 0.0


def test_a_straight_arm_has_no_wrinkles_and_a_bent_one_has(worn: Worn) -> None:
    assert not worn.displacement(_weights(worn, _bent(5.0))).any()
    bent = worn.displacement(_weights(worn, _bent(110.0)))
    left = worn.avatar.mesh.vertices[:, 0] > 0.0
    assert 0.004 < np.abs(bent[left]).max() < 0.02
    assert not bent[~left].any()


def test_one_set_gives_way_to_another_as_the_arm_bends(worn: Worn) -> None:
    names = [s.name for s in worn.sets]
    slight, deep = names.index("left_sleeve_slight"), names.index("left_sleeve_deep")
    a, b = _weights(worn, _bent(45.0)), _weights(worn, _bent(120.0))
    assert (a[slight] > 0.9, a[deep] < 0.2) == (True, True)
    assert (b[deep] > 0.9, b[slight] < 0.4) == (True, True)


def test_cloth_moves_up_the_forearm_and_only_on_its_own_chart(worn: Worn, eva: ChartedAvatar) -> None:
    moved = worn.coordinates(_weights(worn, _bent(120.0))) - eva.avatar.mesh.uv
    chart = next(c for c in eva.charts if c.name == "left_sleeve")
    on = np.zeros(len(moved), bool)
    on[chart.drawn(eva.avatar.mesh)] = True
    assert not moved[~on].any()
    assert not moved[:, 0].any()
    # What is seen comes from nearer the hand: lower on the chart; some 2 cm near the wrist.
    along = moved[on, 1] / chart.scale[1] * tube(eva.avatar, builtin_regions()["sleeve"], "left_").plane[1]
    assert along.min() == pytest.approx(-0.022 * 1.70 / 1.75, rel=0.1)
    inside = moved + eva.avatar.mesh.uv
    low, high = np.array(chart.box[:2]), np.array(chart.box[2:])
    assert ((inside[on] >= low - 0.02) & (inside[on] <= high)).all()


def test_the_texture_is_lit_by_wrinkles_where_they_are(worn: Worn) -> None:
    none = worn.light(np.zeros(len(worn.sets)))
    assert (none == 1.0).all()
    bright = worn.light(_weights(worn, _bent(120.0)))
    assert bright.min() < 0.75
    assert bright.max() > 1.1
    assert 0.001 < np.mean(np.abs(bright - 1.0) > 0.05) < 0.2
    half = 0.5 * _weights(worn, _bent(120.0))
    assert np.abs(worn.light(half) - 1.0).max() < np.abs(bright - 1.0).max()
    assert worn.texture(half).shape == worn.avatar.albedo.shape


class _Camera:
    """Sees the left sleeve from a side, orthographic; half a millimetre a pixel."""

    def __init__(self, worn: Worn, vertices: NDArray[np.float32], turn: float) -> None:
        member = tube(worn.avatar, builtin_regions()["sleeve"], "left_").member
        self._faces = worn.avatar.mesh.triangles[member[worn.avatar.mesh.triangles].all(axis=1)].astype(np.int64)
        self._across = np.array((math.cos(turn), 0.0, -math.sin(turn)))
        at = self._flat(vertices)[self._faces].reshape(-1, 2)
        self._centre = 0.5 * (at.min(axis=0) + at.max(axis=0))

    def _flat(self, vertices: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.stack((vertices @ self._across, vertices[:, 1]), axis=1).astype(np.float64)

    def silhouette(self, vertices: NDArray[np.float32]) -> NDArray[np.bool_]:
        return rasterise((self._flat(vertices) - self._centre) / 0.6 + 0.5, self._faces, 1200)[0] >= 0


@pytest.mark.parametrize("turn", [0.0, 0.8, math.pi / 2])
def test_the_outline_of_a_bent_sleeve_changes_with_wrinkles_on(turn: float, figure: Figure, worn: Worn) -> None:
    mean, most = {}, {}
    for degrees in (5.0, 110.0):
        posture = _bent(degrees)
        plain = figure.pose(posture).vertices.copy()
        wrinkled = figure.pose(posture, (), worn.displacement(_weights(worn, posture))).vertices.copy()
        camera = _Camera(worn, plain, turn)
        a, b = camera.silhouette(plain), camera.silhouette(wrinkled)
        edge = a & ~(np.roll(a, 1, 0) & np.roll(a, -1, 0) & np.roll(a, 1, 1) & np.roll(a, -1, 1))
        # Millimetres between the two outlines: over the whole sleeve on the average, and where they are farthest apart.
        mean[degrees] = 0.5 * float((a ^ b).sum()) / float(edge.sum())
        changed = np.argwhere(a ^ b)
        most[degrees] = 0.5 * float(KDTree(np.argwhere(edge)).query(changed)[0].max()) if len(changed) else 0.0
    assert mean[5.0] == most[5.0] == 0.0
    assert mean[110.0] > 0.12
    assert most[110.0] > 1.8


def test_wrinkles_flatten_where_a_thing_presses_and_stay_elsewhere(figure: Figure, worn: Worn) -> None:
    posture = _bent(110.0)
    given = worn.displacement(_weights(worn, posture))
    bare = figure.pose(posture).vertices.copy()
    state = figure.pose(posture, (), given)
    free = state.vertices.copy()
    raised = np.linalg.norm(free - bare, axis=1)
    top = int(np.argmax(raised))
    # A ball that reaches 6 mm below the skin without wrinkles, at the highest fold.
    centre = (bare[top] + 0.044 * state.normals[top]).astype(np.float64)
    pressing = ghosts_of(PrimitiveSet.of_kinds(["sphere"], [[0.05]], np.eye(3)[None], centre[None]))
    flat = figure.pose(posture, [pressing]).vertices.copy()
    pressed = figure.pose(posture, [pressing], given).vertices.copy()
    left = np.linalg.norm(pressed - flat, axis=1)
    assert raised[top] > 0.004
    assert left[top] < 0.15 * raised[top]
    far = (np.linalg.norm(bare - centre, axis=1) > 0.12) & (given != 0.0)
    assert far.sum() > 20
    assert np.allclose(pressed[far], free[far], atol=1e-5)


def test_skin_that_nothing_wrinkles_is_left_to_the_bit(figure: Figure, worn: Worn) -> None:
    posture = _bent(110.0)
    given = worn.displacement(_weights(worn, posture))
    plain = figure.pose(posture).vertices.copy()
    wrinkled = figure.pose(posture, (), given).vertices
    assert np.array_equal(plain[given == 0.0], wrinkled[given == 0.0])


def test_trousers_follow_knees_and_hips(eva: ChartedAvatar) -> None:
    legs = Worn(eva.avatar, wrinkle_sets(["trousers"]), textures=False)
    dofs = standing().dofs.copy()
    assert not _weights(legs, Posture(dofs)).any()
    dofs[KNEE] = math.radians(95.0)
    weights = dict(zip([s.name for s in legs.sets], _weights(legs, Posture(dofs)), strict=True))
    assert all(weights[f"{side}_{name}"] > 0.5 for side in ("left", "right") for name in ("knee", "hip"))

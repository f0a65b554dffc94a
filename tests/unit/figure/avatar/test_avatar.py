"""The built-in person: a closed, textured mesh in the shape of a human being that fits its joints and primitives."""

import numpy as np
import pytest
import trimesh

from vistel.figure.people import person as people
from vistel.figure.people.bake_kernels import rasterise
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.people.head import MOUTH_Y
from vistel.figure.people.recipe import parse_spec
from vistel.figure.skeleton import JOINT_INDEX

SPEC = "builtin:seed=7,build=1.0,female=0,hair_style=0,top=1,pattern=0"
HEIGHT = 1.82


@pytest.fixture(scope="module")
def avatar():
    return people.make_person(parse_spec(SPEC, "anna"), name="anna", height=HEIGHT, texture_size=512)


@pytest.fixture(scope="module")
def shape(avatar):
    return trimesh.Trimesh(avatar.mesh.vertices, avatar.mesh.triangles, process=False)


def test_every_edge_joins_two_triangles_that_agree_on_the_outside(avatar, shape):
    for mesh in (avatar.mesh, *avatar.eyeballs):
        t = mesh.triangles.astype(np.int64)
        directed = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
        keys = directed[:, 0] * len(mesh.vertices) + directed[:, 1]
        back = directed[:, 1] * len(mesh.vertices) + directed[:, 0]
        assert len(np.unique(keys)) == len(keys)
        assert np.array_equal(np.sort(keys), np.sort(back))
        assert trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).volume > 0
    assert shape.body_count == 1
    assert shape.euler_number == 2  # no handle anywhere: fingers, legs and lips are apart, ears are not pierced


def test_no_vertex_pinches_the_surface(avatar):
    # Round every vertex the triangles form one closed fan.
    t = avatar.mesh.triangles
    after = {(int(a), int(b)): int(c) for tri in t for a, b, c in (tri, np.roll(tri, -1), np.roll(tri, -2))}
    degree = np.bincount(t.ravel(), minlength=len(avatar.mesh.vertices))
    first = dict(after.keys())
    for vertex, start in first.items():
        at, steps = after[(vertex, start)], 1
        while at != start:
            at, steps = after[(vertex, at)], steps + 1
        assert steps == degree[vertex]


def test_about_ten_thousand_vertices_of_which_face_and_hands_have_many(avatar):
    mesh = avatar.mesh
    assert 8_000 <= len(mesh.vertices) <= 12_000
    v = mesh.vertices / (HEIGHT / 1.75)
    assert (v[:, 1] > 1.5).sum() > 1_700
    assert (np.abs(v[:, 0]) > 0.73).sum() > 1_400


def test_it_has_the_measures_of_a_person(avatar, shape):
    low, high = shape.bounds
    assert abs(low[1]) < 0.002
    assert HEIGHT - 0.005 <= high[1] <= HEIGHT + 0.035  # hair stands over the crown
    assert abs((high[0] - low[0]) / HEIGHT - 1.06) < 0.06  # span of the arms
    assert 0.060 <= shape.volume <= 0.110
    assert np.abs(shape.center_mass[0]) < 0.005


def loops(shape, origin, normal, keep):
    """Closed curves in which a plane cuts the mesh, those whose middle `keep` accepts."""
    section = shape.section(plane_origin=origin, plane_normal=normal)
    return [c for c in section.discrete if keep(c.mean(axis=0))]


@pytest.mark.parametrize("side", ["left", "right"])
def test_five_separate_fingers(avatar, shape, side):
    rest, sign = avatar.skeleton.rest, 1.0 if side == "left" else -1.0

    def in_hand(m):
        return sign * m[0] > 0.5

    middle = rest[JOINT_INDEX[f"{side}_middle_intermediate"]]
    assert len(loops(shape, middle, (1, 0, 0), in_hand)) == 4
    thumb = rest[JOINT_INDEX[f"{side}_thumb_distal"]]
    assert len(loops(shape, thumb, (0, 0, 1), lambda m: in_hand(m) and m[2] > 0.045)) == 1
    # Beyond the middle of its bone, no finger is thicker than a finger.
    for curve in loops(shape, middle, (1, 0, 0), in_hand):
        assert np.ptp(curve, axis=0).max() < 0.024


def test_limbs_lie_round_their_bones(avatar, shape):
    rest = avatar.skeleton.rest
    for side in ("left", "right"):
        for upper, lower, axis in (
            ("upper_arm", "lower_arm", 0),
            ("lower_arm", "hand", 0),
            ("upper_leg", "lower_leg", 1),
            ("lower_leg", "foot", 1),
        ):
            a, b = rest[JOINT_INDEX[f"{side}_{upper}"]], rest[JOINT_INDEX[f"{side}_{lower}"]]
            at = a + 0.6 * (b - a)
            normal = np.eye(3)[axis]
            near = list(loops(shape, at, normal, lambda m, at=at: np.linalg.norm(m - at) < 0.08))
            assert len(near) == 1
            assert np.linalg.norm(0.5 * (near[0].max(axis=0) + near[0].min(axis=0)) - at) < 0.02


def skin_of(avatar, solid) -> np.ndarray:
    """Vertices at the sculptor's size, without what is in the mouth: it lies behind the lips, inside of what was sculpted."""
    v = avatar.mesh.vertices.astype(np.float64) / (HEIGHT / 1.75)
    by_the_mouth = (np.abs(v[:, 0]) < 0.04) & (np.abs(v[:, 1] - MOUTH_Y) < 0.04) & (v[:, 2] > 0.0)
    return v[~(by_the_mouth & (solid.fields(v) > 0.55))]


def test_left_and_right_are_mirror_images(avatar):
    solid = people.sculpt(parse_spec(SPEC, "anna"))
    v = skin_of(avatar, solid)[::7]
    bare = v[v[:, 1] < 1.66]  # the parted fringe may fall to one side
    mirrored = bare * (-1.0, 1.0, 1.0)
    assert np.max(np.abs(solid.fields(bare) - solid.fields(mirrored))) < 1e-9
    assert np.max(np.linalg.norm(solid.project(mirrored) - mirrored, axis=1)) < 0.002


def test_vertices_lie_on_the_sculpted_surface(avatar):
    solid = people.sculpt(parse_spec(SPEC, "anna"))
    off = np.abs(solid.fields(skin_of(avatar, solid)) - 0.5)
    assert np.median(off) < 1e-3
    assert (off < 0.05).mean() > 0.97


def test_texture_coordinates_cover_the_texture_without_overlap(avatar):
    # Without overlap the area drawn is the area covered, but for texels cut by edges: hence the fine grid.
    size, drawn, covered = 2048, 0.0, 0.0
    first = 0
    uv, triangles = [], []
    for mesh in (avatar.mesh, *avatar.eyeballs):
        assert mesh.uv.min() >= 0
        assert mesh.uv.max() <= 1
        assert np.array_equal(mesh.corner_vertex[mesh.corner_triangles], mesh.triangles)
        (ax, ay), (bx, by), (cx, cy) = (mesh.uv[mesh.corner_triangles[:, k]].astype(np.float64).T for k in range(3))
        drawn += 0.5 * np.abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)).sum()
        uv.append(mesh.uv)
        triangles.append(mesh.corner_triangles + first)
        first += len(mesh.uv)
    owner, _ = rasterise(np.concatenate(uv).astype(np.float64), np.concatenate(triangles).astype(np.int64), size)
    covered = (owner >= 0).mean()
    assert 0.35 <= covered <= 1.0
    assert drawn - covered < 0.01


def test_the_bodys_primitives_fit_the_mesh(avatar):
    body, rest = avatar.body, avatar.skeleton.rest
    p = avatar.mesh.vertices.astype(np.float64)
    distance = np.full(len(p), np.inf)
    for i in range(len(body)):
        a, b = rest[body.joint[i]] + body.a[i], rest[body.joint[i]] + body.b[i]
        d = b - a
        u = np.clip((p - a) @ d / max(d @ d, 1e-12), 0, 1)
        radius = body.radius_a[i] + u * (body.radius_b[i] - body.radius_a[i])
        distance = np.minimum(distance, np.linalg.norm(p - a - u[:, None] * d, axis=1) - radius)
    assert np.median(np.abs(distance)) <= 0.006
    assert np.quantile(np.abs(distance), 0.95) <= 0.02


def test_limbs_are_told_apart(avatar):
    names = np.array(avatar.body.names)[avatar.mesh.limb]
    v = avatar.mesh.vertices
    assert np.all(v[np.char.startswith(names.astype(str), "left_"), 0] > -0.05)
    assert np.all(v[np.char.startswith(names.astype(str), "right_"), 0] < 0.05)
    assert set(names) >= {"skull", "face", "neck", "chest", "left_thigh", "right_shank", "left_index_distal"}


def test_the_eyeballs_sit_at_their_joints_behind_the_lids(avatar):
    scale = HEIGHT / 1.75
    for eyeball, joint in zip(avatar.eyeballs, ("left_eye", "right_eye"), strict=True):
        centre = avatar.skeleton.rest[JOINT_INDEX[joint]]
        radii = np.linalg.norm(eyeball.vertices - centre, axis=1)
        assert radii.min() > 0.011 * scale and radii.max() < 0.015 * scale
        lids = np.linalg.norm(avatar.mesh.vertices - centre, axis=1)
        assert (lids < 0.016 * scale).sum() > 20


@pytest.mark.slow
def test_the_same_seed_gives_the_same_person_and_another_one_looks_different(avatar):
    again = people.make_person(parse_spec(SPEC, "berta"), name="berta", height=HEIGHT, texture_size=512)
    assert np.array_equal(again.mesh.vertices, avatar.mesh.vertices)
    assert np.array_equal(again.albedo, avatar.albedo)
    other = builtin_avatar("builtin:seed=4,pattern=4,top=7", name="ben", height=HEIGHT)
    assert np.abs(mean_colour(other, "chest") - mean_colour(avatar, "chest")).max() > 25


def mean_colour(avatar, limb):
    """Mean texture colour over the vertices of a limb."""
    mesh, size = avatar.mesh, avatar.albedo.shape[0]
    of_limb = mesh.limb[mesh.corner_vertex] == avatar.body.names.index(limb)
    x, y = (mesh.uv[of_limb] * (1, -1) + (0, 1)).T * (size - 1)
    return avatar.albedo[y.astype(int), x.astype(int)].mean(axis=0)


@pytest.mark.parametrize(
    ("spec", "complaint"),
    [
        ("scan:7", "expected builtin"),
        ("builtin:seed", "expected key=value"),
        ("builtin:colour=3", "unknown key 'colour'"),
        ("builtin:seed=x", "seed: expected a whole number"),
        ("builtin:build=9", "build: expected a number from 0.8"),
        ("builtin:hair_style=2.5", "hair_style: expected a whole number"),
        ("builtin:nose=nan", "nose: expected a number"),
    ],
)
def test_a_wrong_spec_is_named(spec, complaint):
    with pytest.raises(ValueError, match="avatar ") as fault:
        parse_spec(spec, "anna")
    assert complaint in str(fault.value)


def test_an_implausible_height_is_refused(tmp_path):
    with pytest.raises(ValueError, match="height: expected"):
        builtin_avatar("builtin", name="anna", height=12.0, cache=tmp_path)


def test_names_make_people(avatar):
    assert parse_spec("builtin", "anna") == parse_spec("builtin", "anna")
    assert parse_spec("builtin", "anna") != parse_spec("builtin", "berta")

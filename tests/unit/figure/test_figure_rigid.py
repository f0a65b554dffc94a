"""The rigid component of a figure: rest, girth under twist and bend, smoothness."""

import math

import numpy as np
import pytest
from figure_fixture import tube_person
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.figure.figure import vertex_normals
from vistel.figure.posture.posture import ELBOW, SHOULDER, WRIST, Posture, pose_joints, rest_pose
from vistel.figure.rigid.component import RigidSkin
from vistel.figure.skeleton import JOINT_INDEX, JOINTS


@pytest.fixture(scope="module")
def person():
    return tube_person()


@pytest.fixture(scope="module")
def skin(person):
    mesh = person.mesh
    return RigidSkin(person.skeleton, mesh.vertices, vertex_normals(mesh), mesh.triangles, person.body.joint[mesh.limb])


def posed(person, skin, dofs=None, hands=None):
    posture = Posture(np.zeros(25) if dofs is None else dofs, np.zeros((2, 20)) if hands is None else hands)
    vertices, normals = np.empty_like(person.mesh.vertices), np.empty_like(person.mesh.vertices)
    joints = pose_joints(person.skeleton, posture)
    skin.pose(joints, vertices, normals)
    return vertices, normals, joints


def test_rest_pose_is_reproduced_exactly(person, skin):
    vertices, normals = np.empty_like(person.mesh.vertices), np.empty_like(person.mesh.vertices)
    skin.pose(rest_pose(person.skeleton), vertices, normals)
    np.testing.assert_array_equal(vertices, person.mesh.vertices)
    np.testing.assert_array_equal(normals, vertex_normals(person.mesh))


def test_weights_sum_to_one_and_name_real_bones(skin):
    np.testing.assert_allclose(skin.influences.weight.sum(axis=1), 1.0, atol=1e-6)
    assert skin.influences.weight.min() >= 0.0
    assert skin.influences.bone.max() < len(JOINTS) + 4


@pytest.mark.parametrize("degrees", [90, 180, -175])
def test_a_twisted_forearm_keeps_its_girth(person, skin, degrees):
    dofs = np.zeros(25)
    dofs[WRIST["left"]] = (math.radians(degrees), 0.0, 0.0)
    vertices, _, joints = posed(person, skin, dofs)
    rows = np.flatnonzero(person.body.joint[person.mesh.limb] == JOINT_INDEX["left_lower_arm"])
    elbow = joints.position[JOINT_INDEX["left_lower_arm"]]
    rows = rows[np.abs(person.mesh.vertices[rows, 0] - elbow[0] - 0.13) < 0.09]
    before = np.hypot(*(person.mesh.vertices[rows] - elbow)[:, 1:].T)
    after = np.hypot(*(vertices[rows] - elbow)[:, 1:].T)
    assert np.max(np.abs(after / before - 1.0)) < 0.02


def test_twist_grows_along_the_forearm(person, skin):
    dofs = np.zeros(25)
    dofs[WRIST["left"]] = (math.radians(90), 0.0, 0.0)
    vertices, _, joints = posed(person, skin, dofs)
    elbow = joints.position[JOINT_INDEX["left_lower_arm"]]
    rows = np.flatnonzero(person.body.joint[person.mesh.limb] == JOINT_INDEX["left_lower_arm"])
    rows = rows[np.argsort(person.mesh.vertices[rows, 0])]
    angle = [np.arctan2(*(p[rows] - elbow)[:, :0:-1].T) for p in (person.mesh.vertices, vertices)]
    turn = (angle[1] - angle[0] + np.pi) % (2 * np.pi) - np.pi
    x = person.mesh.vertices[rows, 0] - elbow[0]
    means = [turn[(x > low) & (x < low + 0.04)].mean() for low in (0.0, 0.06, 0.12, 0.18)]
    assert means == sorted(means)
    assert means[0] < math.radians(15)
    assert means[-1] > math.radians(65)


def test_a_folded_elbow_does_not_collapse(person, skin):
    dofs = np.zeros(25)
    dofs[ELBOW["left"]] = math.radians(150)
    vertices, _, joints = posed(person, skin, dofs)
    elbow = joints.position[JOINT_INDEX["left_lower_arm"]].astype(np.float32)
    rest = np.linalg.norm(person.mesh.vertices - elbow, axis=1)
    rows = rest < 0.06
    now = np.linalg.norm(vertices - elbow, axis=1)
    assert np.max(np.abs(now[rows] / rest[rows] - 1.0)) < 0.05


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_any_posture_gives_finite_vertices_unit_normals_and_no_torn_edges(person, skin, seed):
    rng = np.random.default_rng(seed)
    dofs = rng.uniform(-1, 1, 25)
    dofs[5:8] *= 0.03
    dofs[SHOULDER["left"]] *= 1.5
    dofs[[0, 1, 14, 21]] = rng.uniform(0, 2.4, 4)
    dofs[0] *= 0.2
    vertices, normals, _ = posed(person, skin, dofs, rng.uniform(0, 1.5, (2, 20)))
    assert np.isfinite(vertices).all()
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-4)
    edges = np.concatenate([person.mesh.triangles[:, [0, 1]], person.mesh.triangles[:, [1, 2]]])
    length = [np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in (person.mesh.vertices, vertices)]
    assert np.max(length[1] - length[0]) < 0.08

"""Poses: what composes comes apart again, and points go where their frame does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix

numbers = st.floats(-2.0, 2.0)
triples = st.tuples(numbers, numbers, numbers).map(np.array)
poses = st.builds(lambda p, v: Pose(p, quaternion_from_matrix(matrix_from_rotvec(v))), triples, triples)


def near(a: Pose, b: Pose) -> bool:
    return bool(np.allclose(a.position, b.position, atol=1e-9) and np.allclose(a.matrix, b.matrix, atol=1e-9))


@given(outer=poses, inner=poses, point=triples)
def test_a_composed_pose_takes_points_through_both_frames(outer: Pose, inner: Pose, point: np.ndarray) -> None:
    assert outer.compose(inner).apply(point) == pytest.approx(outer.apply(inner.apply(point)), abs=1e-9)


@given(pose=poses, other=poses)
def test_inverse_and_relative_poses_undo_composing(pose: Pose, other: Pose) -> None:
    assert near(pose.inverse().compose(pose.compose(other)), other)
    assert near(pose.compose(other).relative_to(pose.matrix, pose.position), other)


@given(a=poses, b=poses)
def test_interpolation_begins_and_ends_at_its_poses_and_turns_half_way_in_the_middle(a: Pose, b: Pose) -> None:
    assert near(a.interpolate(b, 0.0), a)
    assert near(a.interpolate(b, 1.0), b)
    middle = a.interpolate(b, 0.5)
    assert middle.position == pytest.approx((a.position + b.position) / 2.0)
    assert np.trace(a.matrix.T @ middle.matrix) == pytest.approx(np.trace(middle.matrix.T @ b.matrix), abs=1e-6)


def test_points_of_any_shape_are_moved() -> None:
    quarter = Pose(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]))
    points = np.array([[[1.0, 0.0, 0.0], [0.0, 1.0, 2.0]]])
    assert quarter.apply(points) == pytest.approx(np.array([[[1.0, 1.0, 0.0], [0.0, 0.0, 2.0]]]))

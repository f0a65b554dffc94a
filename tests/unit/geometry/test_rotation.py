"""Rotations: every form turns into every other and back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vistel.geometry.rotation import (
    inverse,
    matrix_from_quaternion,
    matrix_from_rotvec,
    quaternion_from_matrix,
    quaternion_product,
    rotation_x,
    rotation_y,
    rotation_z,
    rotvec_from_matrix,
    rotvec_from_quaternion,
    slerp,
)

components = st.floats(-1.0, 1.0)
vectors = st.tuples(components, components, components).map(np.array)
quaternions = (
    st.tuples(components, components, components, components)
    .map(np.array)
    .filter(lambda q: float(np.linalg.norm(q)) > 0.1)
    .map(lambda q: q / np.linalg.norm(q))
)


@given(v=vectors)
def test_rotation_vector_there_and_back(v: np.ndarray) -> None:
    assert rotvec_from_matrix(matrix_from_rotvec(v)) == pytest.approx(v, abs=1e-9)


@given(q=quaternions)
def test_matrix_is_a_rotation_and_its_quaternion_the_same_up_to_sign(q: np.ndarray) -> None:
    m = matrix_from_quaternion(q)
    assert m @ m.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(m) == pytest.approx(1.0)
    assert abs(float(quaternion_from_matrix(m) @ q)) == pytest.approx(1.0, abs=1e-12)


@given(q=quaternions)
def test_rotation_vector_of_a_quaternion_takes_the_short_way(q: np.ndarray) -> None:
    v = rotvec_from_quaternion(q)
    assert np.linalg.norm(v) <= math.pi + 1e-9
    assert matrix_from_rotvec(v) == pytest.approx(matrix_from_quaternion(q), abs=1e-9)


@pytest.mark.parametrize("turn", [rotation_x, rotation_y, rotation_z])
def test_half_turns_survive(turn) -> None:
    m = turn(math.pi)
    assert matrix_from_quaternion(quaternion_from_matrix(m)) == pytest.approx(m, abs=1e-12)


def test_positive_turns_are_right_handed() -> None:
    assert rotation_x(math.pi / 2) @ (0, 1, 0) == pytest.approx((0, 0, 1))
    assert rotation_y(math.pi / 2) @ (0, 0, 1) == pytest.approx((1, 0, 0))
    assert rotation_z(math.pi / 2) @ (1, 0, 0) == pytest.approx((0, 1, 0))


@given(a=quaternions, b=quaternions, t=st.floats(0.0, 1.0))
def test_slerp_goes_evenly_along_the_shorter_arc(a: np.ndarray, b: np.ndarray, t: float) -> None:
    def angle(p: np.ndarray, q: np.ndarray) -> float:
        return 2.0 * math.acos(min(1.0, abs(float(p @ q))))

    whole = angle(a, b)
    assert angle(a, slerp(a, b, t)) == pytest.approx(t * whole, abs=2e-3)
    assert np.linalg.norm(slerp(a, b, t)) == pytest.approx(1.0)


@given(a=quaternions, b=quaternions)
def test_a_product_of_quaternions_turns_by_the_second_first_and_an_inverse_back(a: np.ndarray, b: np.ndarray) -> None:
    turned = Rotation.from_quat(quaternion_product(a, b)).as_matrix()
    assert turned == pytest.approx((Rotation.from_quat(a) * Rotation.from_quat(b)).as_matrix(), abs=1e-12)
    assert quaternion_product(inverse(a), a) == pytest.approx([0.0, 0.0, 0.0, 1.0], abs=1e-12)

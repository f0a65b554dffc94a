"""Looking about and walking at a window."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.render.interaction.navigation import HIGHEST, LOWEST, REACH, STEEPEST, Deflection, Viewpoint, navigated
from vistel.render.view.camera import look_at

START = Viewpoint(np.array((0.2, 1.5, 1.0)), 0.4, -0.2)
angle = st.floats(-40.0, 40.0)
metres = st.floats(-20.0, 20.0)


def test_a_viewpoint_sees_what_the_camera_saw_where_it_began() -> None:
    camera = look_at(np.array((0.5, 1.6, -1.2)), np.array((0.0, 0.9, 0.3)), 0.9)
    again = Viewpoint.at(camera).camera
    assert again.position == pytest.approx(camera.position)
    assert again.rotation == pytest.approx(camera.rotation, abs=1e-9)
    assert again.field_of_view == camera.field_of_view


@pytest.mark.parametrize(
    ("key", "way"),
    [("w", (0.0, 0.0, -1.0)), ("s", (0.0, 0.0, 1.0)), ("a", (-1.0, 0.0, 0.0)), ("d", (1.0, 0.0, 0.0)), ("e", (0.0, 1.0, 0.0))],
)
def test_keys_walk_where_the_camera_looks_but_along_the_floor(key: str, way: tuple[float, float, float]) -> None:
    there = navigated(START, {key}, Deflection(), 0.1)
    level = Viewpoint(START.position, START.heading, 0.0).camera.rotation
    assert there.position - START.position == pytest.approx(0.14 * level @ np.array(way), abs=1e-9)
    assert np.linalg.norm(navigated(START, {key, "shift"}, Deflection(), 0.1).position - START.position) == pytest.approx(0.35)


def test_two_keys_at_once_are_no_faster_than_one() -> None:
    step = navigated(START, {"w", "d"}, Deflection(), 0.1).position - START.position
    assert np.linalg.norm(step) == pytest.approx(0.14)
    assert navigated(START, {"w", "s"}, Deflection(), 0.1).position == pytest.approx(START.position)


@given(angle, angle, metres, metres, metres, st.floats(-100.0, 100.0))
def test_nobody_leaves_the_room_or_stands_on_their_head(
    heading: float, pitch: float, right: float, up: float, back: float, notches: float
) -> None:
    there = START.turned(heading, pitch).moved(right, up, back).zoomed(notches)
    x, y, z = there.position
    assert math.hypot(x, z) <= REACH + 1e-9 and LOWEST <= y <= HIGHEST
    assert abs(there.pitch) <= STEEPEST and abs(there.heading) <= math.pi
    assert 0.2 < there.field_of_view < 1.7
    assert np.linalg.det(there.camera.rotation) == pytest.approx(1.0)
    assert there.camera.rotation[1, 1] > 0.0


def test_a_picture_that_took_long_moves_nobody_far() -> None:
    assert np.linalg.norm(navigated(START, {"w"}, Deflection(), 30.0).position - START.position) < 0.2
    assert navigated(START, {"w"}, Deflection(), -1.0).position == pytest.approx(START.position)


def test_pushing_a_3d_mouse_away_walks_ahead_and_turning_it_to_the_left_turns_left() -> None:
    ahead = navigated(START, set(), Deflection(push=(0.0, 0.0, -1.0)), 0.1).position - START.position
    assert ahead @ START.ahead > 0.1
    turned = navigated(START, set(), Deflection(turn=(0.0, 1.0, 0.0)), 0.1)
    assert START.camera.rotation[:, 0] @ turned.ahead < 0.0

"""What a mouse points at, and leading things with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.geometry.pose import Pose
from vistel.render.interaction.dragging import Dragging
from vistel.render.interaction.picking import Hit, Ray, Targets, on_plane, ray_through
from vistel.render.interaction.requests import Drop
from vistel.render.view.camera import look_at
from vistel.render.view.screens import RoomScreen, Sight, Stereo, fitted, sights_of_screens
from vistel.space.room import meeting_room
from vistel.space.things.tessellate import tessellate, tessellate_thing
from vistel.space.things.things import ThingPrimitive

WIDTH, HEIGHT = 640, 400
EYE = look_at(np.array((0.1, 1.3, -0.9)), np.array((0.0, 0.8, 0.1)), 0.9)
UPRIGHT = np.array((0.0, 0.0, 0.0, 1.0))


def ball(radius: float = 0.05) -> Targets:
    targets = Targets()
    targets.put("ball", [tessellate(ThingPrimitive("sphere", (radius,)), 1.0)])
    return targets


@given(st.floats(-0.3, 0.3), st.floats(0.7, 1.0), st.floats(-0.2, 0.4))
def test_the_ray_of_the_pixel_where_a_place_is_drawn_goes_through_it(x: float, y: float, z: float) -> None:
    place = np.array((x, y, z))
    u, v, _ = EYE.project(place[None], WIDTH, HEIGHT)[0]
    ray = ray_through([Sight(EYE)], u, v, (WIDTH, HEIGHT))
    assert ray is not None
    away = place - ray.origin
    assert np.linalg.norm(np.cross(away, ray.direction)) < 1e-6


def test_on_a_wall_of_screens_a_mouse_points_through_the_screen_and_the_eye_it_is_over() -> None:
    flat = RoomScreen("s", np.array((0.4, 0.9, 1.0)), np.array((-0.4, 0.9, 1.0)), np.array((0.4, 1.5, 1.0)), WIDTH, HEIGHT)
    eyes = np.array(((0.03, 1.2, 0.0), (-0.03, 1.2, 0.0)))
    for stereo in (Stereo.SIDE_BY_SIDE, Stereo.QUAD_BUFFER, Stereo.TOP_BOTTOM):
        size = WIDTH * stereo.widths, HEIGHT
        sights = sights_of_screens((flat,), eyes, stereo, 0)
        for sight in sights:
            assert sight.box is not None
            left, bottom, w, h = sight.box
            ray = ray_through(sights, left + 0.25 * w, size[1] - bottom - 0.5 * h, size)
            assert ray is not None and ray.origin is sight.camera.position
            there = on_plane(ray, flat.lower_left, np.array((0.0, 0.0, 1.0)))
            assert there == pytest.approx((0.2, 1.2, 1.0))
    assert ray_through(sights, -3.0, 5.0, size) is None


def test_the_first_of_two_things_in_a_row_is_met_and_only_within_its_surface() -> None:
    targets = ball()
    targets.put("far", [tessellate(ThingPrimitive("sphere", (0.05,)), 1.0)])
    poses = {"ball": (np.array((0.0, 1.0, 1.0)), UPRIGHT), "far": (np.array((0.0, 1.0, 2.0)), UPRIGHT)}
    for up, met in ((0.0, "ball"), (0.048, "ball"), (0.052, None), (-0.2, None)):
        hit = targets.first_hit(Ray(np.array((0.0, 1.0 + up, 0.0)), np.array((0.0, 0.0, 1.0))), poses)
        assert (hit.thing if hit else None) == met
    hit = targets.first_hit(Ray(np.array((0.0, 1.0, 0.0)), np.array((0.0, 0.0, 1.0))), poses)
    assert hit is not None and hit.distance == pytest.approx(0.95, abs=0.003)
    behind = targets.first_hit(Ray(np.array((0.0, 1.0, 3.0)), np.array((0.0, 0.0, 1.0))), poses)
    assert behind is None


def test_every_loose_thing_of_the_room_is_met_where_it_stands_and_the_table_from_above() -> None:
    targets, poses = Targets(), {}
    for thing in meeting_room(3).things:
        targets.put(thing.id, tessellate_thing(thing, 0.4))
        poses[thing.id] = Pose(thing.position, thing.rotation)
    loose = [t for t in meeting_room(3).things if not t.fixed]
    assert len(loose) >= 5
    for thing in loose:
        if thing.shape == "ring":
            continue  # there is nothing in its middle
        from_above = Ray(thing.position + np.array((0.0, 1.0, 0.0)), np.array((0.0, -1.0, 0.0)))
        hit = targets.first_hit(from_above, poses)
        assert hit is not None and hit.thing == thing.id
    table = targets.first_hit(Ray(np.array((0.0, 2.0, 0.35)), np.array((0.0, -1.0, 0.0))), {"table": poses["table"]})
    assert table is not None and table.place[1] == pytest.approx(0.74, abs=0.03)


def test_a_thing_on_the_mouse_follows_it_and_stands_on_what_is_under_it() -> None:
    targets = ball()
    targets.put("table", [tessellate(ThingPrimitive("superellipsoid", (0.6, 0.02, 0.6, 0.2, 0.2)), 1.0)])
    poses = {"ball": (np.array((0.0, 0.95, 0.0)), UPRIGHT), "table": (np.array((0.0, 0.7, 0.0)), UPRIGHT)}
    hit = Hit("ball", poses["ball"][0] + np.array((0.0, 0.0, -0.05)), 1.0)
    dragging = Dragging.begin(hit, EYE, poses["ball"], 0)

    def led(place: np.ndarray, t_ns: int) -> np.ndarray:
        way = place - EYE.position
        return dragging.move_to(Ray(EYE.position, way / np.linalg.norm(way)), EYE, targets, poses, t_ns).position

    aside = hit.place + 0.1 * EYE.rotation[:, 0]
    assert led(aside, 20_000_000) == pytest.approx(poses["ball"][0] + 0.1 * EYE.rotation[:, 0], abs=1e-6)
    down = led(hit.place - np.array((0.0, 0.6, 0.0)), 40_000_000)
    assert down[1] == pytest.approx(0.72 + 0.05, abs=0.004)  # on the table, not in it
    far = led(EYE.position + 50.0 * EYE.rotation[:, 0] - EYE.rotation[:, 2], 60_000_000)
    assert math.hypot(far[0], far[2]) <= 4.51
    depth = dragging.depth
    dragging.nearer(-3)
    assert dragging.depth < depth


def test_a_thing_that_does_not_come_along_is_let_go_of_and_one_that_comes_late_is_not() -> None:
    dragging = Dragging("ball", np.zeros(3), UPRIGHT, np.zeros(3), 1.0, 0)
    targets, poses = ball(), {"ball": (np.zeros(3), UPRIGHT)}
    for k in range(1, 40):
        aim = np.array((0.03 * k, 1.0, -1.0))
        way = aim - EYE.position
        dragging.move_to(Ray(EYE.position, way / np.linalg.norm(way)), EYE, targets, poses, k * 30_000_000)
        if k == 20:
            late = dragging.position.copy()
    assert not dragging.lost(late, 40 * 30_000_000)
    assert dragging.lost(np.array((3.0, 1.0, 3.0)), 40 * 30_000_000 + 800_000_000)


def test_a_picture_is_shown_as_large_as_fits_and_two_eyes_squeezed_into_the_shape_of_one() -> None:
    assert fitted((0, 0, 640, 360), (640, 360)) == (0, 0, 640, 360)
    assert fitted((0, 0, 640, 360), (640, 720)) == (0, 180, 640, 360)
    assert fitted((640, 0, 320, 360), (1000, 360)) == (340, 0, 320, 360)
    assert fitted((0, 0, 1280, 360), (640, 360), squeezed=True) == (0, 0, 640, 360)


def led_along(speeds: list[float], every_ns: int = 30_000_000) -> Drop:
    """What is let go of after a mouse went to the right at these speeds [m/s], one picture each."""
    across, far, middle = EYE.rotation[:, 0], 0.0, EYE.position - EYE.rotation[:, 2]
    dragging = Dragging("ball", middle, UPRIGHT, np.zeros(3), 1.0, 0)
    targets, poses = ball(), {"ball": (middle, UPRIGHT)}
    for k, speed in enumerate(speeds, 1):
        far += speed * every_ns * 1e-9
        way = middle + far * across - EYE.position
        dragging.move_to(Ray(EYE.position, way / np.linalg.norm(way)), EYE, targets, poses, k * every_ns)
    return dragging.drop()


@pytest.mark.parametrize("every_ms", [4, 16, 33, 250])
def test_what_is_let_go_of_flies_as_it_was_led_last_however_slow_pictures_are(every_ms: int) -> None:
    steady = led_along([0.5] * 8, every_ms * 1_000_000)
    assert steady.velocity == pytest.approx(0.5 * EYE.rotation[:, 0], abs=1e-6)
    stopped = led_along([2.0] * 4 + [0.0] * (1 + 120 // every_ms), every_ms * 1_000_000)
    assert not stopped.velocity.any()


def test_it_flies_no_faster_than_something_thrown() -> None:
    assert np.linalg.norm(led_along([50.0] * 2).velocity) == pytest.approx(4.0)
    assert not Dragging("ball", np.zeros(3), UPRIGHT, np.zeros(3), 1.0, 0).drop().velocity.any()

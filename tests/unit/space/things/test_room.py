"""The meeting room: seats round the table, things on it."""

import math

import numpy as np
import pytest

from vistel.space.room import BATON, ROOM_RADIUS, TABLE_HEIGHT, meeting_room, seat_pose, table_radius
from vistel.space.things.things import ThingPrimitive


@pytest.mark.parametrize("seats", [1, 2, 3, 5, 12, 40, 100])
def test_every_seat_faces_the_centre_of_the_table(seats: int) -> None:
    for index in range(seats):
        position, heading = seat_pose(seats, index)
        facing = np.array([math.sin(heading), 0.0, math.cos(heading)])
        assert position[1] == 0.0
        np.testing.assert_allclose(facing, -position / np.linalg.norm(position), atol=1e-12)


@pytest.mark.parametrize("seats", [12, 40, 41, 100])
def test_everybody_has_elbow_room_within_the_walls(seats: int) -> None:
    places = np.array([seat_pose(seats, i)[0] for i in range(seats)])
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + np.eye(seats)
    assert apart.min() > 0.58
    assert np.hypot(places[:, 0], places[:, 2]).max() < ROOM_RADIUS


def test_a_seat_that_does_not_exist_is_named() -> None:
    with pytest.raises(ValueError, match="expected 0 to 2, got 3"):
        seat_pose(3, 3)


@pytest.mark.parametrize("seats", [1, 3, 12, 100])
def test_loose_things_lie_on_the_table_and_have_unique_ids(seats: int) -> None:
    room = meeting_room(seats)
    assert len({t.id for t in room.things}) == len(room.things)
    loose = [t for t in room.things if not t.fixed]
    assert len({t.shape for t in loose}) >= 5
    for thing in loose:
        assert TABLE_HEIGHT < thing.position[1] < TABLE_HEIGHT + 0.1
        assert math.hypot(thing.position[0], thing.position[2]) < table_radius(seats) - 0.03


def test_the_baton_is_found_by_its_id_and_clear_of_the_table() -> None:
    baton = meeting_room(3).thing(BATON)
    assert baton.position[1] - 0.012 - TABLE_HEIGHT > 0.03
    assert baton.axes[0].radius == pytest.approx(0.012)


def test_every_thing_is_within_reach_of_somebody() -> None:
    room = meeting_room(3)
    for thing in (t for t in room.things if not t.fixed):
        shoulders = [s.position + np.array([0.0, 1.0, 0.0]) for s in room.seats]
        assert min(np.linalg.norm(thing.position - s) for s in shoulders) < 0.85  # an arm and a little leaning


@pytest.mark.parametrize(
    ("kind", "params", "what"),
    [
        ("teapot", (1.0,), "kind"),
        ("sphere", (-0.1,), "above 0"),
        ("sphere", (float("nan"),), "finite"),
        ("cone_sphere", (0.0,) * 7, "8 numbers"),
        ("superellipsoid", (0.1, 0.1, 0.1, 0.01, 1.0), "exponents"),
        ("rounded_polygon", (0.01, 0.0, 0.0), "vertices"),
    ],
)
def test_a_primitive_that_cannot_be_is_refused(kind: str, params: tuple[float, ...], what: str) -> None:
    with pytest.raises(ValueError, match=what):
        ThingPrimitive(kind, params)

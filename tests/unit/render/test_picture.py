"""What the pictures show, drawn by whatever OpenGL this machine has."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from vistel.figure.posture.posture import SHOULDER, Posture, Stance
from vistel.geometry.pose import Pose
from vistel.render.figures.drawn import in_sight
from vistel.render.figures.figures import DrawableFigure, StandIn
from vistel.render.gl.context import GlContext
from vistel.render.overlays.labels import Label
from vistel.render.overlays.overlays import LabelView
from vistel.render.painter import DrawnThing, Frame, Painter
from vistel.render.room.room import build_room
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import Camera, look_at, overview
from vistel.render.view.screens import Sight
from vistel.space.room import meeting_room, seat_pose
from vistel.space.things.tessellate import tessellate
from vistel.space.things.things import ThingPrimitive

pytestmark = pytest.mark.gl

WIDTH, HEIGHT = 320, 180
LIVE = Timing(0, 0, 0, False)
AHEAD = look_at(np.array((0.0, 1.0, 2.0)), np.array((0.0, 1.0, 0.0)), math.radians(50.0))


@pytest.fixture
def painter(surface: GlContext) -> Iterator[Painter]:
    painter = Painter(surface, WIDTH, HEIGHT, samples=1)
    yield painter
    assert painter.error() == "GL_NO_ERROR"


def dot(painter: Painter, name: str, colour: tuple[float, float, float], radius: float = 0.03) -> None:
    ball = tessellate(ThingPrimitive("sphere", (radius,)))
    painter.set_thing(name, ball, np.tile(np.array(colour, np.float32), (len(ball.vertices), 1)))


def at(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4, dtype=np.float32)
    matrix[:3, 3] = x, y, z
    return matrix


def difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(a.astype(int) - b.astype(int)).max(axis=2)


def shapes(about: ParticipantInfo) -> DrawableFigure:
    return StandIn(about.height)


def seated(seat: int) -> Posture:
    position, heading = seat_pose(3, seat)
    dofs = np.zeros(25)
    dofs[1] = math.pi / 2
    dofs[SHOULDER["left"]], dofs[SHOULDER["right"]] = (0.0, -0.6, -1.1), (0.0, 0.6, 1.1)
    feet = position + 0.42 * np.array((math.sin(heading), 0.0, math.cos(heading)))
    return Posture(dofs, stance=Stance(feet, heading))


def meeting(*names: str, timing: Timing = LIVE) -> Instant:
    room = meeting_room(3)
    world = PlayoutWorld(1, {t.id: Pose(t.position, t.rotation) for t in room.things})
    people = tuple(PersonNow(ParticipantInfo(n, n.title()), seated(i), timing) for i, n in enumerate(names))
    return Instant(0, people, world, {t.id: t for t in room.things})


@pytest.mark.parametrize("place", [(0.0, 1.0, 0.0), (0.5, 1.3, 0.2), (-0.7, 0.8, -0.4), (0.2, 0.6, 0.7)])
def test_a_point_is_drawn_where_the_camera_projects_it(painter: Painter, place: tuple[float, float, float]) -> None:
    dot(painter, "dot", (1.0, 0.0, 0.0))
    painter.draw(Frame([Sight(AHEAD)]))
    empty = painter.image()
    painter.draw(Frame([Sight(AHEAD)], things=[DrawnThing("dot", at(*place))]))
    seen = difference(painter.image(), empty) > 25
    y, x = (c.mean() for c in np.nonzero(seen))
    expected = AHEAD.project(np.array([place]), WIDTH, HEIGHT)[0]
    assert (x + 0.5, y + 0.5) == pytest.approx((expected[0], expected[1]), abs=1.0)
    radius = 0.5 * HEIGHT / math.tan(math.radians(25.0)) * 0.03 / expected[2]
    assert seen.sum() == pytest.approx(math.pi * radius**2, rel=0.25)


def test_the_nearer_of_two_things_hides_the_farther(painter: Painter) -> None:
    dot(painter, "red", (1.0, 0.02, 0.02), 0.1)
    dot(painter, "blue", (0.02, 0.02, 1.0), 0.1)
    for near, far, channel in (("red", "blue", 0), ("blue", "red", 2)):
        things = [DrawnThing(near, at(0, 1, 0.5)), DrawnThing(far, at(0, 1, -0.5))]
        painter.draw(Frame([Sight(AHEAD)], things=things))
        middle = painter.image()[HEIGHT // 2, WIDTH // 2].astype(int)
        assert middle.argmax() == channel


def test_a_camera_behind_a_wall_of_things_it_looks_away_from_sees_none_of_them(painter: Painter) -> None:
    dot(painter, "dot", (1.0, 1.0, 1.0), 0.2)
    away = Camera(AHEAD.position, AHEAD.rotation @ np.diag((-1.0, 1.0, -1.0)), AHEAD.field_of_view)
    painter.draw(Frame([Sight(away)]))
    empty = painter.image()
    painter.draw(Frame([Sight(away)], things=[DrawnThing("dot", at(0, 1, 0))]))
    assert difference(painter.image(), empty).max() == 0


def test_the_room_is_bright_and_full_of_detail(painter: Painter) -> None:
    painter.set_room(*build_room(meeting_room(3)))
    eye = look_at(np.array((0.0, 1.2, -0.7)), np.array((0.0, 0.9, 0.5)), math.radians(56.0))
    painter.draw(Frame([Sight(eye)]))
    image = painter.image()
    assert 60 < image.mean() < 190
    assert image.std() > 25
    assert (image.max(axis=2) < 3).mean() < 0.01  # nothing is left undrawn
    assert (image.min(axis=2) > 252).mean() < 0.05  # nor burnt out


def test_a_thing_throws_its_shadow_on_the_table(painter: Painter) -> None:
    painter.set_room(*build_room(meeting_room(3)))
    dot(painter, "ball", (0.5, 0.5, 0.5), 0.06)
    above = look_at(np.array((0.0, 1.6, 0.01)), np.array((0.0, 0.7, 0.0)), math.radians(50.0))
    painter.draw(Frame([Sight(above)]))
    empty = painter.image().astype(int).sum(axis=2)
    ball = np.array((0.0, 0.95, 0.0))
    for _ in range(3):  # where the CPU draws, shadows follow within two frames
        painter.draw(Frame([Sight(above)], things=[DrawnThing("ball", at(*ball))]))
    change = painter.image().astype(int).sum(axis=2) - empty
    key = np.array((-0.527, 0.773, 0.353))
    on_table = ball - key * (ball[1] - 0.72) / key[1]
    x, y, _ = above.project(on_table[None], WIDTH, HEIGHT)[0]
    assert change[int(y), int(x)] < -40


def test_what_rests_is_drawn_as_it_is_at_rest_and_what_is_bent_as_it_is_bent(painter: Painter) -> None:
    dot(painter, "ball", (0.6, 0.02, 0.02), 0.2)
    ball = tessellate(ThingPrimitive("sphere", (0.2,)), 0.5)
    painter.set_resting("ball", ball, np.tile(np.array((0.02, 0.02, 0.6), np.float32), (len(ball.vertices), 1)))
    colours = []
    for bent in (True, False):
        painter.draw(Frame([Sight(AHEAD)], things=[DrawnThing("ball", at(0.0, 1.0, 0.0), bent)]))
        colours.append(painter.image()[HEIGHT // 2, WIDTH // 2].astype(int))
    red, blue = colours
    assert red[0] > red[2] + 60 and blue[2] > blue[0] + 60
    painter.drop_thing("ball")
    painter.draw(Frame([Sight(AHEAD)], things=[DrawnThing("ball", at(0.0, 1.0, 0.0), False)]))
    assert np.ptp(painter.image()[HEIGHT // 2, WIDTH // 2].astype(int)) < 60


@pytest.mark.parametrize(
    ("place", "seen"), [((0, 1, 0), True), ((0, 1, 5), False), ((30, 1, 0), False), ((0, -20, 0), False), ((2.2, 1, 0), True)]
)
def test_who_is_out_of_sight_is_not_drawn_and_who_may_be_in_it_is(place: tuple[float, float, float], seen: bool) -> None:
    clip = AHEAD.projection(WIDTH / HEIGHT) @ AHEAD.view()
    limbs = np.array([[*place, 0.1, *place, 0.1]], np.float32)
    assert in_sight(clip, limbs) == seen


@pytest.mark.parametrize(("below", "seen"), [(0.0, True), (0.15, True), (0.30, False)])
def test_ones_own_hand_is_drawn_unless_it_is_farther_out_of_the_picture_than_it_is_thick(below: float, seen: bool) -> None:
    view, lower_edge, away = AHEAD.view(), AHEAD.edges(WIDTH / HEIGHT)[2], 0.6
    clip = AHEAD.projection(WIDTH / HEIGHT) @ view
    hand = AHEAD.position - away * view[2, :3] + (away * lower_edge - below * math.hypot(1.0, lower_edge)) * view[1, :3]
    limbs = np.array([[*hand, 0.1, *hand, 0.1]], np.float32)
    assert in_sight(clip, limbs, own=True) == seen
    assert in_sight(clip, limbs)  # of others, hair and clothes may hang there


def test_a_label_is_drawn_over_its_place_and_only_there(painter: Painter) -> None:
    place = np.array((0.3, 1.2, 0.0))
    painter.draw(Frame([Sight(AHEAD)]))
    empty = painter.image()
    painter.draw(Frame([Sight(AHEAD)], labels=[LabelView(Label("Ada Lovelace", "holds the red baton"), place)]))
    changed = difference(painter.image(), empty) > 20
    x, y, _ = AHEAD.project(place[None], WIDTH, HEIGHT)[0]
    rows, columns = np.nonzero(changed)
    assert columns.mean() == pytest.approx(x, abs=3)
    assert rows.max() <= y + 1
    assert 25 < columns.max() - columns.min() < 160
    assert changed.mean() < 0.08


def test_people_at_the_table_are_seen_and_named() -> None:
    studio = SceneRenderer(View(WIDTH, HEIGHT, "room", ""), 3, load=shapes)
    try:
        empty = studio.render(meeting()).copy()
        full = studio.render(meeting("ada", "grace", "linus"))
        assert studio.painter.error() == "GL_NO_ERROR"
        changed = difference(full[..., :3], empty[..., :3]) > 12
        assert 0.08 < changed.mean() < 0.6
        for seat in range(3):  # somebody is where each chair stands
            position, _ = seat_pose(3, seat)
            x, y, _ = overview().project((position + np.array((0.0, 1.0, 0.0)))[None], WIDTH, HEIGHT)[0]
            patch = changed[::-1][int(y) - 6 : int(y) + 6, int(x) - 6 : int(x) + 6]
            assert patch.mean() > 0.5
    finally:
        studio.close()


def test_through_ones_own_eyes_the_own_head_is_not_in_the_way() -> None:
    studio = SceneRenderer(View(WIDTH, HEIGHT, "seat", "ada"), 3, load=shapes)
    try:
        picture = studio.render(meeting("ada", "grace", "linus"))[::-1, :, :3].copy()
        without = studio.render(meeting("ada"))[::-1, :, :3]
        others = difference(picture, without) > 12
        assert 0.03 < others.mean() < 0.7
        assert picture.std() > 25
        middle = picture[HEIGHT // 3 : HEIGHT // 2, WIDTH // 3 : 2 * WIDTH // 3]
        assert middle.std() > 10  # the room, not the inside of a skull
    finally:
        studio.close()


def test_an_avatar_that_cannot_be_had_is_replaced_and_reported(caplog: pytest.LogCaptureFixture) -> None:
    def fails(about: ParticipantInfo) -> DrawableFigure:
        raise ValueError(f"no avatar {about.avatar!r}")

    studio = SceneRenderer(View(WIDTH, HEIGHT, "room", ""), 3, load=fails)
    try:
        instant = meeting("ada")
        studio.render(instant)
        studio._loader.shutdown(wait=True)
        studio.render(instant)
        assert studio._cast["ada"].remark == "avatar missing"
        assert [r for r in caplog.records if "avatar_missing" in r.message and "stand-in" in r.message]
    finally:
        studio.close()


def test_a_figure_that_fails_leaves_the_picture_to_the_others(caplog: pytest.LogCaptureFixture) -> None:
    class Broken(StandIn):
        posed = 0

        def pose(self, *given, **named):
            self.posed += 1
            if self.posed > 1:  # where a GPU draws, loading poses it once
                raise FloatingPointError("not a number")
            return super().pose(*given, **named)

    studio = SceneRenderer(
        View(WIDTH, HEIGHT, "room", ""), 3, load=lambda a: Broken(a.height) if a.name == "ada" else StandIn(a.height)
    )
    try:
        instant = meeting("ada", "grace")
        for _ in range(2):
            studio.render(instant)
            studio._loader.submit(int).result()
        picture = studio.render(instant)
        assert picture[..., :3].std() > 20
        assert sum("figure_failed" in r.message for r in caplog.records) == 1
    finally:
        studio.close()


def test_a_silent_participant_is_marked() -> None:
    studio = SceneRenderer(View(WIDTH, HEIGHT, "room", ""), 3, load=shapes)
    try:
        live = studio.render(meeting("ada")).copy()
        silent = studio.render(meeting("ada", timing=Timing(2_000_000_000, 2_000_000_000, 0, True)))
        assert difference(live[..., :3], silent[..., :3]).max() > 40
    finally:
        studio.close()


def test_things_come_change_and_go() -> None:
    studio = SceneRenderer(View(WIDTH, HEIGHT, "room", ""), 3, load=shapes)
    try:
        full = studio.render(meeting()).copy()
        bare = Instant(0, (), PlayoutWorld(), {})
        gone = studio.render(bare).copy()
        again = studio.render(meeting())
        assert difference(full[..., :3], gone[..., :3]).max() > 60
        assert difference(full[..., :3], again[..., :3]).mean() < 1.0
        assert studio.painter.error() == "GL_NO_ERROR"
    finally:
        studio.close()


@pytest.mark.parametrize("scale", [0.84, 0.5])
def test_a_picture_drawn_of_fewer_pixels_shows_the_same_in_the_same_size(scale: float) -> None:
    studio = SceneRenderer(View(WIDTH, HEIGHT, "room", ""), 3, load=shapes)
    try:
        people = meeting("ada", "grace", "linus")
        studio.render(people)
        whole = studio.render(people).copy()
        studio.draw_at(scale)
        coarse = studio.render(people).copy()
        assert coarse.shape == whole.shape
        assert 0.5 < difference(coarse[..., :3], whole[..., :3]).mean() < 12.0
        studio.draw_at(1.0)
        assert difference(studio.render(people)[..., :3], whole[..., :3]).mean() < 0.5
        assert studio.painter.error() == "GL_NO_ERROR"
    finally:
        studio.close()

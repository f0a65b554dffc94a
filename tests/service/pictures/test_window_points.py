"""Known places of the room, and the pixels at which they come out: in every view, on a wall's windows, in what goes out."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest
from window_pictures import HEIGHT, LOOSE, WIDTH, Pictures, played
from x_server import Hands, x_server

from vistel.figure.posture.posture import Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.render.gl.context import open_surface
from vistel.render.interaction.navigation import Viewpoint
from vistel.render.painter import DrawnThing, Frame, Painter
from vistel.render.view.camera import look_at, overview
from vistel.render.view.screens import RoomScreen, Stereo, boxes, picture_size, sights_of_screens
from vistel.render.view.view import Mode, View
from vistel.space.things.tessellate import tessellate
from vistel.space.things.things import ThingPrimitive
from vistel.wire.clock import SystemClock
from vistel.wire.shared_pictures import PictureReader
from vistel_services.renderer.out.outputs import Out, Outputs
from vistel_services.renderer.window.presenter import opener
from vistel_services.renderer.window.window import Pane

pytestmark = pytest.mark.gl
BALL = LOOSE["ball"].position + np.array((0.0, 0.3, 0.0))


@pytest.fixture
def hands(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hands]:
    with x_server(monkeypatch, WIDTH, HEIGHT) as somebody:
        yield somebody


def near_of(change: np.ndarray, near: np.ndarray, reach: float) -> np.ndarray:
    """The middles of pixels that changed (h, w) near a place, (n, 2), in pixels from the upper left."""
    rows, columns = np.nonzero(change > 40)
    pixels = np.stack((columns, rows), axis=1) + 0.5
    return pixels[np.hypot(*(pixels - near).T) < reach]


def middle(change: np.ndarray, near: np.ndarray, reach: float) -> np.ndarray:
    """Where a picture changed (h, w), in pixels from the upper left."""
    close = near_of(change, near, reach)
    assert close.any(), f"nothing was drawn near {near}"
    return close.mean(axis=0)


def pinhole(eye: np.ndarray, ahead: np.ndarray, field_of_view: float, place: np.ndarray) -> np.ndarray:
    """The pixel of a place for an upright camera, by angles and similar triangles alone."""
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    off = place - eye
    scale = 0.5 * HEIGHT / math.tan(0.5 * field_of_view) / float(off @ ahead)
    return np.array((0.5 * WIDTH + scale * float(off @ right), 0.5 * HEIGHT - scale * float(off @ np.cross(right, ahead))))


def eyes_of(posture: object) -> np.ndarray:
    joints = pose_joints(standard_skeleton(1.75), posture)  # type: ignore[arg-type]
    return joints.position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0)


def test_a_thing_is_seen_from_ones_seat_from_anywhere_and_through_somebody_elses_eyes_where_it_is(hands: Hands) -> None:
    async def seen(p: Pictures) -> np.ndarray:
        empty = await p.draw(4, without="ball")
        whole = await p.draw(4)
        assert empty is not None and whole is not None
        change = np.abs(whole[::-1, :, :3].astype(int) - empty[::-1, :, :3]).max(axis=2)
        (sight,) = p.drawing._renderer._from
        camera = sight.camera
        expected = pinhole(camera.position, -camera.rotation[:, 2], camera.field_of_view, BALL)
        assert middle(change, expected, 30.0) == pytest.approx(expected, abs=1.5)
        return camera.position

    async def play(p: Pictures) -> None:
        p.places["ball"] = BALL
        p.people = {
            "aiko": replace(standing(), stance=Stance(np.array((0.1, standing().stance.position[1], -1.3)), 0.0)),
            "bruno": replace(standing(), stance=Stance(np.array((1.2, standing().stance.position[1], 0.2)), -0.5 * math.pi)),
        }
        for mode, who, eye in (
            (Mode.SEAT, "", eyes_of(p.people["aiko"])),
            (Mode.FOLLOW, "bruno", eyes_of(p.people["bruno"])),
            (Mode.ROOM, "", overview().position),
        ):
            p.interaction.choices = replace(p.interaction.choices, mode=mode, who=who)
            assert await seen(p) == pytest.approx(eye, abs=2e-3)
        navigated = np.array((-0.7, 1.4, 1.1))
        p.interaction.choices = replace(p.interaction.choices, mode=Mode.FREE)
        p.interaction._viewpoint = Viewpoint.at(look_at(navigated, BALL + np.array((0.1, 0.05, 0.0)), 0.7))
        assert await seen(p) == pytest.approx(navigated)

    played(play, View(WIDTH, HEIGHT, "seat", "aiko", light="fast"))


def dot(painter: Painter, n: int, place: np.ndarray) -> DrawnThing:
    ball = tessellate(ThingPrimitive("sphere", (0.015,)), 1.0)
    painter.set_thing(f"dot{n}", ball, np.zeros((len(ball.vertices), 3), np.float32))
    matrix = np.eye(4, dtype=np.float32)
    matrix[:3, 3] = place
    return DrawnThing(f"dot{n}", matrix)


@pytest.mark.parametrize("stereo", [Stereo.MONO, Stereo.SIDE_BY_SIDE, Stereo.TOP_BOTTOM])
def test_on_a_v_of_two_windows_places_come_out_where_lines_from_the_eyes_cross_the_screens(hands: Hands, stereo: Stereo) -> None:
    eyes = np.array(((0.0315, 1.2, 0.0), (-0.0315, 1.2, 0.0)))
    seam, far = np.array((0.0, 0.8, 1.1)), 1.0
    left = RoomScreen("left", np.array((far, 0.8, 0.4)), seam, np.array((far, 1.6, 0.4)), 220, 140)
    right = RoomScreen("right", seam, np.array((-far, 0.8, 0.4)), np.array((0.0, 1.6, 1.1)), 220, 140)
    screens, corners = (left, right), ((5, 10), (240, 150))
    whole = picture_size(screens, stereo)
    panes = [Pane(s.name, 220, 140, at=at, part=box) for s, at, box in zip(screens, corners, boxes(screens, stereo), strict=True)]
    surface = open_surface(opener(panes))
    try:
        painter = Painter(surface, *whole)
        sights = sights_of_screens(screens, eyes, stereo, 0)

        def shown(dots: list[DrawnThing]) -> np.ndarray:
            painter.draw(Frame(sights, things=dots))
            for _ in range(100):
                assert painter.show()
                if all(hands.screen()[y + 30, x + 30].any() for x, y in corners):
                    break
            painter.show()
            return hands.screen()

        empty, count = shown([]), 0
        for n, place in enumerate(((0.5, 1.25, 1.3), (0.3, 1.05, 1.0), (-0.4, 1.3, 1.5), (-0.6, 1.1, 0.9))):
            dots, expected = [dot(painter, n, np.array(place))], list[np.ndarray]()
            for sight in sights:
                s = sight.screen
                assert s is not None and sight.box is not None
                x0, y0 = corners[screens.index(s)]
                across, up = s.lower_right - s.lower_left, s.upper_left - s.lower_left
                eye = sight.camera.position
                _, u, v = np.linalg.solve(np.stack((np.array(place) - eye, -across, -up), axis=1), s.lower_left - eye)
                if not (0.08 < u < 0.92 and 0.08 < v < 0.92) or float((np.array(place) - eye) @ -sight.camera.rotation[:, 2]) < 0.1:
                    continue
                x, y, w, h = sight.box
                x, top = x - 220 * screens.index(s), 140 - y - h
                expected.append(np.array((x0 + x + u * w, y0 + top + (1.0 - v) * h)))
            while True:  # a busy X server shows what it was given a little later
                change = np.abs(shown(dots) - empty).max(axis=2)
                if all(near_of(change, at, 14.0).any() for at in expected):
                    break
            for at in expected:
                assert middle(change, at, 14.0) == pytest.approx(at, abs=1.2)
            count += len(expected)
        assert count == 4 * (1 if stereo is Stereo.MONO else 2)
    finally:
        surface.close()


def test_without_a_window_places_come_out_the_same_in_the_film_and_in_the_memory_of_other_programs(tmp_path: Path) -> None:
    surface = open_surface()
    try:
        painter = Painter(surface, WIDTH, HEIGHT)
        eye, target = np.array((0.4, 1.5, -1.6)), np.array((0.0, 0.9, 0.0))
        camera = look_at(eye, target, 0.8)
        places = [np.array(p) for p in ((0.0, 0.9, 0.0), (0.4, 1.1, 0.3), (-0.5, 0.8, -0.3))]
        sights = sights_of_screens([RoomScreen("s", *_corners(camera), WIDTH, HEIGHT)], np.stack((eye, eye)), Stereo.MONO, 0)
        painter.draw(Frame(sights, things=[dot(painter, n, p) for n, p in enumerate(places)]))
        rgba = np.empty((HEIGHT, WIDTH, 4), np.uint8)
        painter.read_into(rgba)
        painter.draw(Frame(sights))
        empty = painter.image().astype(int)
    finally:
        surface.close()
    film, memory = tmp_path / "a.mp4", tmp_path / "pictures"

    async def out() -> np.ndarray:
        outputs = Outputs("tokyo", Out(film, shared=memory))
        await outputs.open((WIDTH, HEIGHT), 25.0, SystemClock())
        reader = PictureReader(memory)
        for k in range(1, 6):
            outputs.put(k * 40_000_000, rgba, 0, True)
        while (newest := reader.newest()) is None:
            await asyncio.sleep(0.01)  # a thread writes it
        shared = newest.rgba[..., :3].copy()
        reader.close()
        await outputs.close()
        return shared

    shared = asyncio.run(out())
    with av.open(str(film)) as container:
        filmed = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)][-1]
    assert np.array_equal(shared, rgba[::-1, :, :3])
    for picture in (shared, filmed):
        change = np.abs(picture.astype(int) - empty).max(axis=2)
        for place in places:
            expected = pinhole(eye, target - eye, 0.8, place)
            assert middle(change, expected, 14.0) == pytest.approx(expected, abs=1.0)


def _corners(camera: object) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the window a camera looks through, a metre before it."""
    at = [camera.position + camera.through(u, v, WIDTH / HEIGHT) for u, v in ((0, 0), (1, 0), (0, 1))]  # type: ignore[attr-defined]
    return at[0], at[1], at[2]

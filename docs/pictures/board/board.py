"""Draws board.png: a board beside the table of a meeting, with a curve and some words.

python -m docs.pictures.board.board
"""

import math
from pathlib import Path

import cv2
import numpy as np

from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.messages.boards import stroke_message
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import look_at
from vistel.space.boards.stroke import Stroke, packed
from vistel.space.commands.names import COLOURS
from vistel.space.room import Extra, meeting_room

BOARD = Extra("board", "board", "board", 0.04, 0.2, 0.3, 0xFFFFFFFF, 1.5, 1.5)
WIDTH, HEIGHT = 1280, 720
"""Of the picture [pixels]; it is drawn twice as large."""
LETTERS: dict[str, tuple[tuple[tuple[float, float], ...], ...]] = {
    "A": (((0.0, 0.0), (0.35, 1.0), (0.7, 0.0)), ((0.13, 0.4), (0.57, 0.4))),
    "E": (((0.6, 1.0), (0.0, 1.0), (0.0, 0.0), (0.6, 0.0)), ((0.0, 0.5), (0.5, 0.5))),
    "H": (((0.0, 1.0), (0.0, 0.0)), ((0.6, 1.0), (0.6, 0.0)), ((0.0, 0.5), (0.6, 0.5))),
    "I": (((0.2, 1.0), (0.2, 0.0)),),
    "K": (((0.0, 1.0), (0.0, 0.0)), ((0.6, 1.0), (0.0, 0.4), (0.6, 0.0))),
    "L": (((0.0, 1.0), (0.0, 0.0), (0.55, 0.0)),),
    "M": (((0.0, 0.0), (0.08, 1.0), (0.4, 0.3), (0.72, 1.0), (0.8, 0.0)),),
    "N": (((0.0, 0.0), (0.0, 1.0), (0.6, 0.0), (0.6, 1.0)),),
    "T": (((0.0, 1.0), (0.7, 1.0)), ((0.35, 1.0), (0.35, 0.0))),
    "W": (((0.0, 1.0), (0.2, 0.0), (0.4, 0.7), (0.6, 0.0), (0.8, 1.0)),),
    " ": (),
}


def words(text: str, x: float, y: float, high: float) -> list[F64]:
    """The lines of a text whose first letter stands at (x, y), in units of the grid."""
    return [np.array(line) * high + (x + 0.95 * high * n, y) for n, letter in enumerate(text) for line in LETTERS[letter]]


def strokes() -> list[Stroke]:
    """What is on the board."""
    along = np.linspace(0.0, 1.0, 60)
    wave = np.stack([700.0 + 2300.0 * along, 700.0 + 380.0 * np.sin(4.0 * math.pi * along) * (1.0 - 0.6 * along)], axis=1)
    axes = [np.array([(500.0, 150.0), (500.0, 1250.0)]), np.array([(350.0, 700.0), (3250.0, 700.0)])]
    ink = [("black", 18, line) for line in words("MEET AT TEN", 450.0, 1850.0, 260.0)]
    ink += [("blue", 12, line) for line in words("TALK IN A LINE", 450.0, 1560.0, 130.0)]
    ink += [("black", 12, line) for line in axes] + [("red", 20, wave)]
    return [
        Stroke(n + 1, BOARD.id, "aiko", "", COLOURS[colour], width, packed([(round(x), round(y)) for x, y in line.tolist()]))
        for n, (colour, width, line) in enumerate(ink)
    ]


def main() -> None:
    room = meeting_room(3, [BOARD])
    poses = {t.id: Pose(t.position, t.rotation) for t in room.things}
    world = PlayoutWorld(1, poses, strokes={s.number: stroke_message(s) for s in strokes()})
    renderer = SceneRenderer(View(2 * WIDTH, 2 * HEIGHT, "room", "", light="fast"), 3)
    try:
        renderer.camera = look_at(np.array([-1.0, 1.65, -0.9]), np.array([1.1, 1.05, 1.1]), math.radians(48.0))
        picture = renderer.render_complete(Instant(1, (), world, {t.id: t for t in room.things}))
    finally:
        renderer.close()
    small = cv2.resize(np.ascontiguousarray(picture[::-1, :, 2::-1]), (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(Path(__file__).parent / "board.png"), small)


if __name__ == "__main__":
    main()

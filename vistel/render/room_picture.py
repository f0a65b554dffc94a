"""One picture of a room and its things, nobody in it."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from vistel.arrays import U8
from vistel.geometry.pose import Pose
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import Camera, look_at
from vistel.space.files.interior import Interior
from vistel.space.files.surfaces import in_room, pieces_of
from vistel.space.room import Room

FIELD_OF_VIEW = 0.85
"""Upwards [rad]."""
_FROM = np.array((0.42, 0.50, 0.76))
WIDEST = 5.0
"""Beyond this a room is looked at from inside, its middle in the picture [m]."""


def room_picture(interior: Interior, width: int, height: int) -> U8:
    """(height, width, 3) sRGB. Raises NoOpenGlError where nothing can be drawn."""
    things = interior.room.things
    furnished = bool(interior.room.seats) or any(t.fixed for t in things)
    still = Room((), (), shell=interior.room.shell and furnished)
    renderer = SceneRenderer(View(width, height, "room", ""), len(interior.room.seats), decor=replace(interior, room=still))
    try:
        renderer.camera = _camera(interior, width / height)
        poses = {t.id: Pose(t.position, t.rotation) for t in things}
        picture = renderer.render_complete(Instant(1, (), PlayoutWorld(1, poses), MappingProxyType({t.id: t for t in things})))
        return np.ascontiguousarray(picture[::-1, :, :3])
    finally:
        renderer.close()


def _camera(interior: Interior, aspect: float) -> Camera:
    """Far enough for all things that are no walls, from in front and above."""
    parts = [
        in_room(t, p.surface)
        for t in interior.room.things
        if t.shape not in ("wall", "floor", "ceiling", "window", "door")
        for p in pieces_of(t, interior.models, 0.4)
    ]
    points = np.concatenate(parts) if parts else np.array([[-1.0, 0.0, -1.0], [1.0, 1.0, 1.0]])
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    radius = min(0.5 * float(np.linalg.norm(high - low)), 0.5 * WIDEST)
    towards = _FROM / np.linalg.norm(_FROM)
    away = radius / np.sin(0.5 * FIELD_OF_VIEW * min(1.0, aspect))
    return look_at(middle + away * towards, middle, FIELD_OF_VIEW)

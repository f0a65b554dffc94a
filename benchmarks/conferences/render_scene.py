"""The picture of `bench_render` for programs that know nothing of VISTEL: its triangles, textures and camera in one file.

scene.npz: clip (4, 4) room to clip space, view (4, 4) room to camera, field (1,) vertical field of view [rad]; of each mesh
NAME, in the room's frame: NAME.positions, NAME.normals (n, 3), NAME.uv (n, 2) from the bottom left, NAME.triangles (m, 3),
NAME.texture (h, w, 3) sRGB, first row at the top.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from vistel.render.figures.drawn import Corners
from vistel.render.painter import Frame
from vistel.render.room.room import build_room
from vistel.space.room import meeting_room


def save_scene(path: Path, frame: Frame, seats: int, aspect: float) -> int:
    """Write figures and room of a frame with one sight; how many triangles it has. Names and things on the table are not in it."""
    camera = frame.sights[0].camera
    _, _, bottom, top = camera.edges(aspect)
    out: dict[str, Any] = {
        "view": camera.view(),
        "clip": camera.projection(aspect) @ camera.view(),
        "field": np.array([math.atan(top) - math.atan(bottom)]),
    }
    for figure in frame.figures:
        assert isinstance(figure.skin, Corners)
        _put(
            out,
            figure.name,
            figure.skin.positions,
            figure.skin.normals,
            figure.model.uv,
            figure.model.triangles,
            figure.model.texture,
        )
    panels, furniture = build_room(meeting_room(seats))
    for k, panel in enumerate(panels):
        _put(out, f"panel-{k}", panel.positions, panel.normals, panel.uv, panel.triangles, panel.texture[..., :3])
    if furniture is not None:
        wood = np.full((4, 4, 3), (70, 62, 58), np.uint8)
        surface = furniture.surface
        uv = np.zeros((len(surface.vertices), 2), np.float32)
        _put(out, "furniture", surface.vertices, surface.normals, uv, surface.triangles, wood)
    np.savez(path, **out)
    return sum(len(values) for name, values in out.items() if name.endswith(".triangles"))


def _put(out: dict[str, Any], name: str, *arrays: np.ndarray) -> None:
    for part, values in zip(("positions", "normals", "uv", "triangles", "texture"), arrays, strict=True):
        out[f"{name}.{part}"] = np.ascontiguousarray(values)

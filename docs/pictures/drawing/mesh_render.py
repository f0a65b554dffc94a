"""Photographs of meshes by OpenGL without a window: textured people and plain things together."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from vistel.arrays import F32
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.render.figures.portrait import PLAIN_FRAGMENT, PLAIN_VERTEX, texels
from vistel.render.view.camera import look_at


@dataclass(frozen=True)
class Part:
    """A mesh to be seen: drawn vertices (R, 3) and normals (R, 3), uv (R, 2), triangles (F, 3), texture (H, W, 3 or 4)."""

    vertices: NDArray[np.floating]
    normals: NDArray[np.floating]
    uv: F32
    triangles: NDArray[np.integer]
    texture: NDArray[np.uint8]

    @staticmethod
    def plain(vertices: NDArray[np.floating], triangles: NDArray[np.integer], colour: Sequence[float]) -> "Part":
        """A mesh of one colour."""
        texture = np.full((1, 1, 3), np.multiply(colour, 255), np.uint8)
        return Part(vertices, normals(vertices, triangles), np.zeros((len(vertices), 2), np.float32), triangles, texture)

    @staticmethod
    def worn(avatar: Avatar, mesh: Mesh, vertices: F32, normals: F32) -> "Part":
        """A mesh of an avatar where it is now: vertices, normals (V, 3)."""
        corner = mesh.corner_vertex
        return Part(vertices[corner], normals[corner], mesh.uv, mesh.corner_triangles, texels(avatar))


def normals(vertices: NDArray[np.floating], triangles: NDArray[np.integer]) -> NDArray[np.float64]:
    """Unit vertex normals."""
    p = vertices[triangles].astype(float)
    face = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    out = np.zeros((len(vertices), 3))
    for k in range(3):
        np.add.at(out, triangles[:, k], face)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-20)


@dataclass(frozen=True)
class View:
    """From where [m] to where, and the upright opening [rad]."""

    eye: Sequence[float]
    target: Sequence[float]
    angle: float = 0.5


class Camera:
    """A headless OpenGL context and the program that draws there."""

    def __init__(self, vertex: str, fragment: str) -> None:
        backend = {"backend": "egl"} if os.name == "posix" and not os.environ.get("DISPLAY") else {}
        self.context = moderngl.create_context(standalone=True, require=330, **backend)
        self.program = self.context.program(vertex_shader=vertex, fragment_shader=fragment)

    def expose(self, view: View, size: tuple[int, int], ground: tuple[float, ...], draw: Callable[[], None]) -> Image.Image:
        """What `draw` draws, drawn at twice the size; ground: the colour behind it."""
        width, height = 2 * size[0], 2 * size[1]
        buffer = self.context.simple_framebuffer((width, height))
        buffer.use()
        self.context.enable(moderngl.DEPTH_TEST)
        buffer.clear(*ground)
        camera = look_at(np.array(view.eye, float), np.array(view.target, float), view.angle)
        self.program["view"].write((camera.projection(width / height) @ camera.view()).T.astype("f4").tobytes())  # type: ignore[union-attr]
        self.program["eye"].value = tuple(view.eye)  # type: ignore[union-attr]
        draw()
        image = Image.frombytes("RGB", (width, height), buffer.read(components=3, alignment=1))
        buffer.release()
        return image.transpose(Image.Transpose.FLIP_TOP_BOTTOM).resize(size, Image.Resampling.LANCZOS)

    def texture(self, picture: NDArray[np.uint8], unit: int = 0) -> moderngl.Texture:
        texels = np.ascontiguousarray(picture[::-1]).tobytes()
        out = self.context.texture(picture.shape[1::-1], picture.shape[2], texels, alignment=1)
        out.build_mipmaps()
        out.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        out.use(unit)
        return out

    def draw(self, rows: Sequence[NDArray[np.floating]], layout: str, names: Sequence[str], triangles: NDArray[np.integer]) -> None:
        """Triangles whose vertices have these attributes."""
        vertices = self.context.buffer(np.hstack(rows).astype("f4").tobytes())
        index = self.context.buffer(triangles.astype("i4").tobytes())
        self.context.vertex_array(self.program, [(vertices, layout, *names)], index).render()


class Studio(Camera):
    """Photographs parts."""

    def __init__(self) -> None:
        super().__init__(PLAIN_VERTEX, PLAIN_FRAGMENT)

    def photograph(
        self, parts: Sequence[Part], eye: Sequence[float], target: Sequence[float], size: tuple[int, int], angle: float
    ) -> Image.Image:
        """A picture of `size` pixels; eye, target in the room [m]; angle: opening, in radians, upright."""

        def draw() -> None:
            for part in parts:
                texture = self.texture(part.texture)
                self.draw((part.vertices, part.normals, part.uv), "3f 3f 2f", ("position", "normal", "uv"), part.triangles)
                texture.release()

        return self.expose(View(eye, target, angle), size, (0.93, 0.94, 0.95), draw)

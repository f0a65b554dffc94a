"""Photographs of meshes by OpenGL without a window: textured people and plain things together."""

import os
from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from docs.pictures.people.avatars import FRAGMENT, VERTEX, view_matrix
from vistel.arrays import F32
from vistel.figure.avatar.avatar import Avatar, Mesh


@dataclass(frozen=True)
class Part:
    """A mesh to be seen: drawn vertices (R, 3) and normals (R, 3), uv (R, 2), triangles (F, 3), texture (H, W, 3)."""

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
        return Part(vertices[corner], normals[corner], mesh.uv, mesh.corner_triangles, avatar.albedo)


def normals(vertices: NDArray[np.floating], triangles: NDArray[np.integer]) -> NDArray[np.float64]:
    """Unit vertex normals."""
    p = vertices[triangles].astype(float)
    face = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    out = np.zeros((len(vertices), 3))
    for k in range(3):
        np.add.at(out, triangles[:, k], face)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-20)


class Studio:
    """A headless OpenGL context."""

    def __init__(self) -> None:
        backend = {"backend": "egl"} if os.name == "posix" and not os.environ.get("DISPLAY") else {}
        self.context = moderngl.create_context(standalone=True, require=330, **backend)
        self.program = self.context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)

    def photograph(
        self, parts: Sequence[Part], eye: Sequence[float], target: Sequence[float], size: tuple[int, int], angle: float
    ) -> Image.Image:
        """A picture of `size` pixels; eye, target in the room [m]; angle: opening, in radians, upright."""
        context, (width, height) = self.context, (2 * size[0], 2 * size[1])
        buffer = context.simple_framebuffer((width, height))
        buffer.use()
        context.enable(moderngl.DEPTH_TEST)
        buffer.clear(0.93, 0.94, 0.95)
        matrix = view_matrix(np.array(eye, float), np.array(target, float), angle, width / height)
        self.program["view"].write(matrix.T.astype("f4").tobytes())  # type: ignore[union-attr]
        self.program["eye"].value = tuple(eye)  # type: ignore[union-attr]
        self.program["ink"].value = 0.0  # type: ignore[union-attr]
        for part in parts:
            texture = context.texture(part.texture.shape[1::-1], 3, part.texture[::-1].tobytes(), alignment=1)
            texture.build_mipmaps()
            texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
            texture.use()
            rows = np.hstack([part.vertices, part.normals, part.uv]).astype("f4")
            drawn = [(context.buffer(rows.tobytes()), "3f 3f 2f", "position", "normal", "uv")]
            context.vertex_array(self.program, drawn, context.buffer(part.triangles.astype("i4").tobytes())).render()
            texture.release()
        image = Image.frombytes("RGB", (width, height), buffer.read(components=3, alignment=1))
        buffer.release()
        return image.transpose(Image.Transpose.FLIP_TOP_BOTTOM).resize(size, Image.Resampling.LANCZOS)

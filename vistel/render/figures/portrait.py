"""Pictures of figures alone, without a room: for looking at an avatar. Needs an OpenGL context (software is fine)."""

from collections.abc import Sequence

import moderngl
import numpy as np
from PIL import Image, ImageDraw

from vistel.arrays import U8
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import Posture, standing
from vistel.render.gl.context import open_surface
from vistel.render.gl.programs import vertex_array
from vistel.render.view.camera import look_at

Point = tuple[float, float, float]

_LABEL = 15
_BACKGROUND = (0.80, 0.815, 0.835)
PLAIN_VERTEX = """#version 330
uniform mat4 view; in vec3 position; in vec3 normal; in vec2 uv; out vec3 n; out vec3 p; out vec2 t;
void main() { gl_Position = view * vec4(position, 1.0); n = normal; p = position; t = uv; }"""
"""Vertex shader of textured meshes under fixed lamps; `view` takes the room to the picture."""
PLAIN_FRAGMENT = """#version 330
uniform sampler2D albedo; uniform vec3 eye; in vec3 n; in vec3 p; in vec2 t; out vec4 colour;
void main() {
    vec3 N = normalize(gl_FrontFacing ? n : -n), V = normalize(eye - p), key = normalize(vec3(0.5, 0.7, 0.8));
    vec4 texel = texture(albedo, t);
    if (texel.a < 0.5) discard;
    vec3 base = pow(texel.rgb, vec3(2.2));
    vec3 light = vec3(0.26 + 0.16 * N.y) + 0.78 * max(0.0, dot(N, key))
        + vec3(0.20, 0.22, 0.26) * max(0.0, dot(N, normalize(vec3(-0.8, 0.2, 0.5)))) + 0.2 * max(0.0, -N.z);
    float shine = 0.05 * pow(max(0.0, dot(N, normalize(key + V))), 24.0);
    colour = vec4(pow(base * light + shine, vec3(1.0 / 2.2)), 1.0);
}"""
"""Fragment shader for it; `eye` is where the viewer stands [m]."""


def texels(avatar: Avatar) -> U8:
    """(H, W, 4) the avatar's picture, with alpha 0 where its patches have holes."""
    height, width = avatar.albedo.shape[:2]
    alpha = np.full((height, width), 255, np.uint8)
    for patch in avatar.patches:
        if patch.opacity is not None:
            left, right = (round(u * width) for u in (patch.box[0], patch.box[2]))
            top, bottom = (round((1.0 - v) * height) for v in (patch.box[3], patch.box[1]))
            seen = Image.fromarray(patch.opacity).resize((right - left, bottom - top), Image.Resampling.BILINEAR)
            alpha[top:bottom, left:right] = np.where(np.asarray(seen) >= 255.0 * patch.cutoff, 255, 0)
    return np.dstack((avatar.albedo, alpha))


class Portraits:
    """Photographs avatars. Create, use and close in one thread."""

    def __init__(self) -> None:
        self._surface = open_surface()
        self._program = self._surface.ctx.program(vertex_shader=PLAIN_VERTEX, fragment_shader=PLAIN_FRAGMENT)

    def close(self) -> None:
        """Give the context back."""
        self._surface.close()

    def picture(
        self, figure: Figure, posture: Posture, eye: Sequence[float], target: Sequence[float], size: tuple[int, int], angle: float
    ) -> Image.Image:
        """`figure` in `posture`, seen from `eye` towards `target` [m]; angle: vertical opening [rad]; size in pixels."""
        ctx, avatar = self._surface.ctx, figure.avatar
        state = figure.pose(posture)
        width, height = 2 * size[0], 2 * size[1]
        target_buffer = ctx.framebuffer([ctx.texture((width, height), 4)], ctx.depth_renderbuffer((width, height)))
        target_buffer.use()
        ctx.enable_only(moderngl.DEPTH_TEST)
        target_buffer.clear(*_BACKGROUND, 1.0)
        texture = ctx.texture(avatar.albedo.shape[1::-1], 4, np.ascontiguousarray(texels(avatar)[::-1]).tobytes(), alignment=1)
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        texture.use()
        camera = look_at(np.array(eye, np.float64), np.array(target, np.float64), angle)
        matrix = camera.projection(width / height) @ camera.view()
        self._program["view"].write(np.ascontiguousarray(matrix.T, np.float32).tobytes())  # type: ignore[union-attr]
        self._program["eye"].value = tuple(eye)  # type: ignore[union-attr]
        held: list[moderngl.Buffer | moderngl.VertexArray] = []
        meshes = zip((avatar.mesh, *avatar.eyeballs), ((state.vertices, state.normals), *state.eyeballs), strict=False)
        for mesh, (vertices, normals) in meshes:
            rows = np.hstack([vertices[mesh.corner_vertex], normals[mesh.corner_vertex], mesh.uv]).astype(np.float32)
            buffer = ctx.buffer(np.ascontiguousarray(rows).tobytes())
            index = ctx.buffer(np.ascontiguousarray(mesh.corner_triangles, np.int32).tobytes())
            array = vertex_array(ctx, self._program, [(buffer, "3f 3f 2f", "position", "normal", "uv")], index)
            array.render()
            held += [array, buffer, index]
        shown = Image.frombytes("RGB", (width, height), target_buffer.read(components=3, alignment=1))
        for thing in (*held, texture, *target_buffer.color_attachments, target_buffer.depth_attachment, target_buffer):
            thing.release()
        return shown.transpose(Image.Transpose.FLIP_TOP_BOTTOM).resize(size, Image.Resampling.LANCZOS)

    def sheet(
        self, avatars: Sequence[Avatar], postures: dict[str, Posture], cell: tuple[int, int] = (200, 260), columns: int = 0
    ) -> Image.Image:
        """Each avatar's face and postures, names above; `columns` pictures to a line, 0 for all in one."""
        labels = ["face", *postures]
        columns = columns or len(labels)
        lines = -(-len(labels) // columns)
        high = cell[1] + _LABEL
        out = Image.new("RGB", (columns * cell[0], len(avatars) * lines * high), "white")
        ink = ImageDraw.Draw(out)
        for row, avatar in enumerate(avatars):
            figure = Figure(avatar)
            for k, label in enumerate(labels):
                x, y = (k % columns) * cell[0], (row * lines + k // columns) * high
                ink.text((x + 6, y + 2), label, fill=(40, 44, 50))
                posture = postures.get(label, standing())
                eye, centre, angle = _close(avatar) if label == "face" else _whole(avatar, figure, posture)
                out.paste(self.picture(figure, posture, eye, centre, cell, angle), (x, y + _LABEL))
        return out


def _close(avatar: Avatar) -> tuple[Point, Point, float]:
    middle = 0.93 * avatar.skeleton.height
    return (0.30, middle + 0.03, 0.85), (0.0, middle, 0.0), 0.42


def _whole(avatar: Avatar, figure: Figure, posture: Posture) -> tuple[Point, Point, float]:
    """From half right; as near as the posed figure allows."""
    vertices = figure.pose(posture).vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    x, y, z = (0.5 * (low + high)).tolist()
    size = max(float(high[1] - low[1]), 1.25 * float(np.hypot(high[0] - low[0], high[2] - low[2])), 0.72 * avatar.skeleton.height)
    away = 2.0 * size
    return (x + 0.40 * away, y + 0.14 * away, z + 0.90 * away), (x, y, z), 0.55

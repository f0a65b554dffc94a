"""Draws built-in people: avatars.png (who they are) and avatar_close.png (face, hand, mesh).

    python -m docs.pictures.people.avatars [--out FOLDER] [SPEC ...]

Needs an OpenGL context (EGL without a display; software is fine).
"""

import argparse
import logging
import os
from pathlib import Path

import moderngl
import numpy as np
from PIL import Image

from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.people.builtin import builtin_avatar
from vistel.render.view.camera import look_at

PEOPLE = ("seed=3,hair_style=5", "seed=2", "seed=7,hair_style=0", "seed=12,hair_style=3", "seed=4,pattern=4,top=7", "seed=5")

VERTEX = """#version 330
uniform mat4 view; in vec3 position; in vec3 normal; in vec2 uv; out vec3 n; out vec3 p; out vec2 t;
void main() { gl_Position = view * vec4(position, 1.0); n = normal; p = position; t = uv; }"""
FRAGMENT = """#version 330
uniform sampler2D albedo; uniform vec3 eye; uniform float ink; in vec3 n; in vec3 p; in vec2 t; out vec4 colour;
void main() {
    vec3 N = normalize(n), V = normalize(eye - p), key = normalize(vec3(0.5, 0.7, 0.8));
    vec3 base = pow(texture(albedo, t).rgb, vec3(2.2));
    vec3 light = vec3(0.26 + 0.16 * N.y) + 0.78 * max(0.0, dot(N, key))
        + vec3(0.20, 0.22, 0.26) * max(0.0, dot(N, normalize(vec3(-0.8, 0.2, 0.5)))) + 0.2 * max(0.0, -N.z);
    float shine = 0.05 * pow(max(0.0, dot(N, normalize(key + V))), 24.0);
    colour = vec4(mix(pow(base * light + shine, vec3(1.0 / 2.2)), vec3(0.08), ink), 1.0);
}"""


def view_matrix(eye: np.ndarray, target: np.ndarray, angle: float, aspect: float) -> np.ndarray:
    """(4, 4) projection times view of a camera at `eye`; vertical opening angle in radians."""
    camera = look_at(eye, target, angle)
    return camera.projection(aspect) @ camera.view()


def drawn(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Interleaved position, normal, uv of the drawn vertices and the triangles."""
    v, t = mesh.vertices, mesh.triangles
    face = np.cross(v[t[:, 1]] - v[t[:, 0]], v[t[:, 2]] - v[t[:, 0]])
    normal = np.zeros_like(v)
    for k in range(3):
        np.add.at(normal, t[:, k], face)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    rows = np.hstack([v[mesh.corner_vertex], normal[mesh.corner_vertex], mesh.uv])
    return np.ascontiguousarray(rows, np.float32), mesh.corner_triangles


class Studio:
    """A headless OpenGL context that photographs avatars."""

    def __init__(self) -> None:
        backend = {"backend": "egl"} if os.name == "posix" and not os.environ.get("DISPLAY") else {}
        self.context = moderngl.create_context(standalone=True, require=330, **backend)
        self.program = self.context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)

    def photograph(
        self,
        avatar: Avatar,
        eye: tuple[float, ...],
        target: tuple[float, ...],
        size: tuple[int, int],
        angle: float,
        *,
        lines: bool = False,
    ) -> Image.Image:
        """A picture of `size` pixels; eye and target in the model frame [m]; with `lines` the triangles' edges."""
        context, (width, height) = self.context, (2 * size[0], 2 * size[1])
        target_buffer = context.simple_framebuffer((width, height))
        target_buffer.use()
        context.enable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        target_buffer.clear(0.76, 0.78, 0.81)
        texture = context.texture(avatar.albedo.shape[1::-1], 3, avatar.albedo[::-1].tobytes(), alignment=1)
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        texture.use()
        matrix = view_matrix(np.array(eye), np.array(target), angle, width / height)
        self.program["view"].write(matrix.T.astype("f4").tobytes())  # type: ignore[union-attr]
        self.program["eye"].value = tuple(eye)  # type: ignore[union-attr]
        for mesh in (avatar.mesh, *avatar.eyeballs):
            rows, triangles = drawn(mesh)
            for ink in (0.0, 0.75) if lines else (0.0,):
                self.program["ink"].value = ink  # type: ignore[union-attr]
                context.wireframe = ink > 0.0
                if ink > 0.0:
                    rows[:, :3] += 2e-4 * rows[:, 3:6]
                buffer = context.buffer(rows.tobytes())
                index = context.buffer(triangles.astype("i4").tobytes())
                context.vertex_array(self.program, [(buffer, "3f 3f 2f", "position", "normal", "uv")], index).render()
            context.wireframe = False
        picture = Image.frombytes("RGB", (width, height), target_buffer.read(components=3, alignment=1))
        target_buffer.release()
        texture.release()
        return picture.transpose(Image.Transpose.FLIP_TOP_BOTTOM).resize(size, Image.Resampling.LANCZOS)


def sheet(rows: list[list[Image.Image]]) -> Image.Image:
    """The pictures side by side, row by row."""
    out = Image.new("RGB", (sum(i.width for i in rows[0]), sum(row[0].height for row in rows)))
    y = 0
    for row in rows:
        for k, picture in enumerate(row):
            out.paste(picture, (k * picture.width, y))
        y += row[0].height
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("people", nargs="*", default=PEOPLE, help='what follows "builtin:", for example seed=3,build=1.1')
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(name)s %(message)s")
    avatars = [builtin_avatar(f"builtin:{person}", name=person, height=1.75) for person in arguments.people]
    studio = Studio()
    whole = [studio.photograph(a, (1.1, 1.25, 3.7), (0.0, 0.885, 0.0), (300, 310), 0.54) for a in avatars]
    faces = [studio.photograph(a, (0.26, 1.64, 0.72), (0.0, 1.605, 0.0), (300, 340), 0.46) for a in avatars]
    sheet([whole, faces]).save(arguments.out / "avatars.png", optimize=True)
    first = avatars[0]
    views = (
        ((0.0, 1.64, 0.75), (0.0, 1.615, 0.0)),
        ((0.78, 1.64, 0.05), (0.0, 1.615, 0.0)),
        ((0.84, 1.85, 0.25), (0.83, 1.41, 0.015)),
        ((0.5, 0.35, 1.0), (0.0, 0.12, 0.05)),
    )
    rows = [[studio.photograph(first, eye, at, (420, 460), 0.45, lines=lines) for eye, at in views] for lines in (False, True)]
    sheet(rows).save(arguments.out / "avatar_close.png", optimize=True)


if __name__ == "__main__":
    main()

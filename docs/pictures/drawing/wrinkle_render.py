"""Photographs of figures that wear wrinkles: moved texture coordinates, and the light of wrinkles at those that did not move."""

from collections.abc import Mapping

import numpy as np
from PIL import Image

from docs.pictures.drawing.mesh_render import Camera, View
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.render.figures.portrait import texels
from vistel.wrinkle.worn import Worn

VERTEX = """#version 330
uniform mat4 view; in vec3 position; in vec3 normal; in vec2 uv; in vec2 rest; out vec3 n; out vec3 p; out vec2 t; out vec2 r;
void main() { gl_Position = view * vec4(position, 1.0); n = normal; p = position; t = uv; r = rest; }"""
FRAGMENT = """#version 330
uniform sampler2D albedo; uniform sampler2D wrinkles; uniform vec3 eye; uniform float plain;
in vec3 n; in vec3 p; in vec2 t; in vec2 r; out vec4 colour;
void main() {
    vec3 N = normalize(n), V = normalize(eye - p), key = normalize(vec3(0.5, 0.7, 0.8));
    vec4 texel = texture(albedo, t);
    if (texel.a < 0.5) discard;
    vec3 base = mix(pow(texel.rgb, vec3(2.2)), vec3(0.5), plain) * texture(wrinkles, r).r * 2.0;
    vec3 light = vec3(0.26 + 0.16 * N.y) + 0.78 * max(0.0, dot(N, key))
        + vec3(0.20, 0.22, 0.26) * max(0.0, dot(N, normalize(vec3(-0.8, 0.2, 0.5)))) + 0.2 * max(0.0, -N.z);
    float shine = 0.05 * pow(max(0.0, dot(N, normalize(key + V))), 24.0);
    colour = vec4(pow(base * light + shine, vec3(1.0 / 2.2)), 1.0);
}"""


class Studio(Camera):
    """Photographs figures with their wrinkles."""

    def __init__(self) -> None:
        super().__init__(VERTEX, FRAGMENT)
        self.program["wrinkles"].value = 1  # type: ignore[union-attr]

    def photograph(
        self,
        figure: Figure,
        worn: Worn,
        posture: Posture,
        view: View,
        size: tuple[int, int],
        *,
        actions: Mapping[str, float] | None = None,
        wrinkled: bool = True,
        plain: bool = False,
    ) -> Image.Image:
        """The figure in a posture, with the wrinkles that go with it or without. plain: grey, to see the shape alone."""
        avatar = figure.avatar
        weights = worn.weights(pose_joints(avatar.skeleton, posture), actions) * float(wrinkled)
        state = figure.pose(posture, (), worn.displacement(weights))
        self.program["plain"].value = float(plain)  # type: ignore[union-attr]
        light = np.clip(worn.light(weights) * 127.5, 0, 255).astype(np.uint8)[..., None]
        textures = [self.texture(texels(avatar)), self.texture(light, 1)]
        for texture in textures:
            texture.anisotropy = 8.0
        meshes = [(avatar.mesh, state.vertices, state.normals, worn.coordinates(weights))]
        meshes += [(m, v, n, m.uv) for m, (v, n) in zip(avatar.eyeballs, state.eyeballs, strict=True)]

        def draw() -> None:
            for mesh, vertices, normals, uv in meshes:
                rows = (vertices[mesh.corner_vertex], normals[mesh.corner_vertex], uv, mesh.uv)
                self.draw(rows, "3f 3f 2f 2f", ("position", "normal", "uv", "rest"), mesh.corner_triangles)

        image = self.expose(view, size, (0.80, 0.815, 0.835), draw)
        for texture in textures:
            texture.release()
        return image

"""The room that does not move: shell with baked light and colour, furniture with its place's light per vertex."""

from dataclasses import dataclass

import cv2
import numpy as np

from vistel.arrays import F32, F64, I32, U8
from vistel.render.light.shadow import KEY_DIRECTION
from vistel.render.room import bake, paint
from vistel.space.room import TABLE_HEIGHT, Room
from vistel.space.things.tessellate import Surface3, join, tessellate
from vistel.space.things.things import Thing

FURNITURE = ("table", "chair")
"""Shapes of fixed things that are drawn with the room, from its plan; all others come from the world."""
KEY_SHADOWED = "KEY_SHADOWED"
"""Define of the shader of surfaces on which the key light's shadow falls."""
FINISHED = "FINISHED"
"""Define of the shader of surfaces that shine."""
SHADOWED = 2.1
"""Half the side of the floor's middle, in which shadows fall [m]."""
X = bake.HALF_X
Z = bake.HALF_Z
H = bake.HEIGHT


@dataclass(frozen=True)
class ShellPanel:
    """A piece of the shell: positions and normals (n, 3), uv (n, 2) origin bottom left, triangles (m, 3).

    key: "KEY_SHADOWED" where the roof's key light falls and shadows with it, or "FINISHED" where nothing changes.
    texture: (h, w, 4) first row at the top; of a finished panel what is seen, else the square roots of linear colour
    and of baked light / 1.6. gloss: of its varnish. casts: it throws a shadow itself, as table tops do.
    """

    positions: F32
    normals: F32
    uv: F32
    triangles: I32
    texture: U8
    key: str
    gloss: float
    casts: bool = False


@dataclass(frozen=True)
class Furniture:
    """All furniture as one surface; tint: (n, 4) linear colour and the ambient light at the vertex."""

    surface: Surface3
    tint: F32


def linear(colour: int) -> tuple[float, float, float]:
    """Linear colour of 0xRRGGBBAA."""
    r, g, b = ((colour >> s & 0xFF) / 255.0 for s in (24, 16, 8))
    return r**2.2, g**2.2, b**2.2


def drawn_with_room(room: Room) -> list[Thing]:
    """The things that are drawn with the room: table and chairs of the built-in one."""
    return [t for t in room.things if t.fixed and t.shape in FURNITURE]


def build_room(room: Room) -> tuple[list[ShellPanel], Furniture | None]:
    """Shell, table top and furniture of a meeting room; a room without things has no furniture."""
    discs = _discs(room)
    fixed = drawn_with_room(room)
    panels = [*_floor(discs), _ceiling(), *_walls()] if room.shell else []
    surfaces: list[Surface3] = []
    tints: list[F32] = []
    for thing in fixed:
        for k, primitive in enumerate(thing.primitives):
            placed = tessellate(primitive, 1.0 if thing.shape == "table" and k == 0 else 0.4)
            placed = placed.moved(thing.position, thing.rotation)
            if thing.shape == "table" and k == 0:
                panels.append(_table_top(placed, primitive.params[0]))
                continue
            surfaces.append(placed)
            tints.append(_tint(thing, k, placed, discs))
    return panels, Furniture(join(surfaces), np.concatenate(tints)) if surfaces else None


def _discs(room: Room) -> F64:
    """Table and seats as horizontal discs that hide light."""
    rows: list[tuple[float, float, float, float]] = []
    for thing in drawn_with_room(room):
        if thing.shape == "table":
            rows.append((0.0, TABLE_HEIGHT, 0.0, thing.primitives[0].params[0]))
        else:
            rows.append((thing.position[0], 0.42, thing.position[2], 0.2))
    return np.array(rows, np.float64).reshape(-1, 4)


def _tint(thing: Thing, part: int, surface: Surface3, discs: F64) -> F32:
    colour = np.array(linear(thing.colour))
    if thing.shape == "chair" and part >= 2:
        colour = np.array((0.055, 0.05, 0.045))  # blackened steel
    elif thing.shape == "table":
        colour = colour * 0.35
    lower = discs[discs[:, 1] > TABLE_HEIGHT - 0.01] if thing.shape == "chair" else discs
    open_share = bake.openness(surface.vertices.astype(np.float64), surface.normals.astype(np.float64), lower)
    return np.column_stack((np.tile(colour, (len(open_share), 1)), open_share)).astype(np.float32)


def _texture(colour: F32, light: F64 | F32) -> U8:
    rgba = np.concatenate((colour, (np.asarray(light) / 1.6)[..., None]), axis=2)
    return (np.sqrt(np.clip(rgba, 0.0, 1.0)) * 255.0 + 0.5).astype(np.uint8)


def finished(texture: U8, facing: float) -> U8:
    """A panel's texture as it is seen: lit, with the display's curve. facing: cosine of its normal to the key light.

    The same numbers as in shaders/room.frag.glsl and common.glsl.
    """
    linear_light = np.square(texture.astype(np.float32) / 255.0)
    light = linear_light[..., 3:] * (1.63, 1.60, 1.54) + max(0.0, facing) * np.array((1.86, 1.74, 1.55))
    c = 0.62 * linear_light[..., :3] * light
    seen = np.sqrt(np.clip(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0))
    out = np.full_like(texture, 255)
    out[..., :3] = seen * 255.0 + 0.5
    return out


def _plane(h: int, w: int, origin: F64, right: F64, up: F64) -> F64:
    """(h, w, 3) room points of a texture's texels, first row at the top."""
    u = (np.arange(w) + 0.5) / w
    v = 1.0 - (np.arange(h) + 0.5) / h
    return origin + u[None, :, None] * right + v[:, None, None] * up


def _quad(origin: F64, right: F64, up: F64, seen: U8) -> ShellPanel:
    normal = np.cross(right, up)
    normal /= np.linalg.norm(normal)
    positions = np.array((origin, origin + right, origin + right + up, origin + up), np.float32)
    uv = np.array(((0, 0), (1, 0), (1, 1), (0, 1)), np.float32)
    triangles = np.array(((0, 1, 2), (0, 2, 3)), np.int32)
    return ShellPanel(positions, np.tile(normal.astype(np.float32), (4, 1)), uv, triangles, seen, FINISHED, 0.0)


def _baked(size: tuple[int, int], origin: F64, right: F64, up: F64, discs: F64) -> F32:
    """Light on a plane, computed on a coarse grid and smoothed up to `size` (h, w)."""
    h, w = max(8, size[0] // 6), max(8, size[1] // 6)
    normal = np.cross(right, up)
    points = _plane(h, w, origin, right, up).reshape(-1, 3)
    values = bake.light(points, normal / np.linalg.norm(normal), discs).reshape(h, w)
    smooth = cv2.resize(values.astype(np.float32), (size[1], size[0]), interpolation=cv2.INTER_CUBIC)
    return np.asarray(smooth, np.float32)


def _v(x: float, y: float, z: float) -> F64:
    return np.array((x, y, z), np.float64)


def _floor(discs: F64) -> list[ShellPanel]:
    """The middle, where shadows fall, and the rest, where none reach and none need be looked up."""
    size = 1024
    origin, right, up = _v(-X, 0, Z), _v(2 * X, 0, 0), _v(0, 0, -2 * Z)
    texture = _texture(paint.floor(size, 2 * X), _baked((size, size), origin, right, up, discs))
    at = np.array((-1.0, -SHADOWED / X, SHADOWED / X, 1.0))
    u, v = np.meshgrid(0.5 + 0.5 * at, 0.5 + 0.5 * at)
    uv = np.stack((u.ravel(), v.ravel()), axis=1)
    positions = (origin + uv[:, :1] * right + uv[:, 1:] * up).astype(np.float32)
    normals = np.tile(np.array((0.0, 1.0, 0.0), np.float32), (16, 1))
    cells = {
        (i, j): ((4 * j + i, 4 * j + i + 1, 4 * j + i + 5), (4 * j + i, 4 * j + i + 5, 4 * j + i + 4))
        for i in range(3)
        for j in range(3)
    }
    middle = np.array(cells.pop((1, 1)), np.int32)
    rest = np.array([t for pair in cells.values() for t in pair], np.int32)
    seen = finished(texture, float(KEY_DIRECTION[1]))
    return [
        ShellPanel(positions, normals, uv.astype(np.float32), triangles, image, key, 0.0)
        for triangles, image, key in ((middle, texture, KEY_SHADOWED), (rest, seen, FINISHED))
    ]


def _ceiling() -> ShellPanel:
    size = 256
    origin, right, up = _v(-X, H, -Z), _v(2 * X, 0, 0), _v(0, 0, 2 * Z)
    light = _baked((size, size), origin, right, up, np.zeros((0, 4))) + 0.25
    colour = np.full((size, size, 3), 0.62, np.float32)
    points = _plane(size, size, origin, right, up)
    inside = np.maximum(np.abs(points[..., 0]), np.abs(points[..., 2]))
    colour[inside < bake.ROOF_LIGHT + 0.06] = 0.35
    lamp = inside < bake.ROOF_LIGHT
    colour[lamp], light[lamp] = (0.94, 0.97, 1.0), 1.6
    return _quad(origin, right, up, finished(_texture(colour, light), 0.0))


def _walls() -> list[ShellPanel]:
    """Window at -X, door at +X, paintings at -Z and +Z; each painted as seen from inside."""
    scale = 110.0
    out: list[ShellPanel] = []
    sides = (
        (_v(-X, 0, Z), _v(0, 0, -2 * Z), 2 * Z),
        (_v(X, 0, -Z), _v(0, 0, 2 * Z), 2 * Z),
        (_v(-X, 0, -Z), _v(2 * X, 0, 0), 2 * X),
        (_v(X, 0, Z), _v(-2 * X, 0, 0), 2 * X),
    )
    for k, (origin, right, width) in enumerate(sides):
        wall = paint.Wall(width, H, scale, 20 + k)
        middle = 0.5 * width
        if k == 0:
            _window(wall, middle)
        elif k == 1:
            _door(wall, middle - 2.4)
            wall.framed((middle - 0.75, 1.25, middle + 0.75, 2.25), paint.abstract(120, 180, 8))
            _shelf(wall, middle + 1.5)
        elif k == 2:
            for j, x in enumerate((-1.9, -0.45, 1.0)):
                wall.framed((middle + x, 1.22, middle + x + 0.95, 2.28), paint.abstract(120, 110, 31 + j))
        else:
            wall.framed((middle - 1.1, 1.2, middle + 1.1, 2.3), paint.abstract(130, 260, 44))
            _shelf(wall, middle + 1.7)
            _shelf(wall, middle - 3.2)
        h, w = wall.colour.shape[:2]
        up = _v(0, H, 0)
        light = _baked((h, w), origin, right, up, np.zeros((0, 4)))
        light = np.where(wall.glow > 0, wall.glow, light)
        out.append(_quad(origin, right, up, finished(_texture(wall.colour, light), 0.0)))
    return out


def _window(wall: paint.Wall, middle: float) -> None:
    z0, z1, y0, y1 = bake.WINDOW
    wall.panel((middle + z0 - 0.10, y0 - 0.10, middle + z1 + 0.10, y1 + 0.10), (0.66, 0.64, 0.60), 0.02)
    picture = paint.view(300, 800)
    wall.image((middle + z0, y0, middle + z1, y1), picture, 1.6)
    for x in np.linspace(z0, z1, 4)[1:-1]:
        wall.panel((middle + x - 0.035, y0, middle + x + 0.035, y1), (0.62, 0.60, 0.56), 0.012)
        wall.glow[wall.pixels((middle + x - 0.035, y0, middle + x + 0.035, y1))] = 0.0
    wall.panel((middle + z0 - 0.16, y0 - 0.15, middle + z1 + 0.16, y0 - 0.07), (0.70, 0.68, 0.64), 0.015)


def _door(wall: paint.Wall, x: float) -> None:
    wall.panel((x - 0.55, 0.0, x + 0.55, 2.16), (0.50, 0.44, 0.35), 0.015)
    wall.panel((x - 0.46, 0.0, x + 0.46, 2.07), (0.30, 0.175, 0.09), 0.012)
    for y0, y1 in ((0.18, 0.92), (1.08, 1.92)):
        wall.panel((x - 0.34, y0, x + 0.34, y1), (0.245, 0.14, 0.072), 0.012)
    wall.panel((x + 0.37, 0.99, x + 0.43, 1.05), (0.75, 0.66, 0.42), 0.01)


def _shelf(wall: paint.Wall, x: float) -> None:
    """A bookcase seen from the front."""
    width, top = 1.3, 1.95
    wall.shadow((x, 0.1, x + width, top))
    wall.panel((x, 0.0, x + width, top), (0.20, 0.125, 0.07), 0.01)
    rng = wall.rng
    tones = ((0.42, 0.12, 0.08), (0.12, 0.22, 0.33), (0.55, 0.45, 0.25), (0.16, 0.27, 0.17), (0.62, 0.58, 0.50), (0.25, 0.12, 0.22))
    for level in np.arange(0.12, top - 0.3, 0.36):
        wall.panel((x + 0.03, level, x + width - 0.03, level + 0.32), (0.075, 0.05, 0.03))
        at = x + 0.05
        while at < x + width - 0.12:
            w, h = rng.uniform(0.025, 0.06), rng.uniform(0.19, 0.29)
            if rng.uniform() > 0.12:
                wall.panel((at, level, at + w, level + h), tones[int(rng.integers(len(tones)))], 0.009)
            at += w


def _table_top(surface: Surface3, radius: float) -> ShellPanel:
    size = 768
    colour = paint.table_top(size, radius)
    p = surface.vertices
    uv = np.stack((0.5 + 0.5 * p[:, 0] / radius, 0.5 - 0.5 * p[:, 2] / radius), axis=1).astype(np.float32)
    return ShellPanel(
        p, surface.normals, uv, surface.triangles, _texture(colour, np.full((size, size), 0.72)), KEY_SHADOWED, 0.42, casts=True
    )

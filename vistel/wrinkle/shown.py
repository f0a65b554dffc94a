"""Wrinkles as a renderer draws them: nothing but arrays, for all levels of detail of a figure.

The light of every set is stored on the texture once, in one of four channels; sets that overlap are in different ones. A
drawn vertex knows which set of each channel is near it, so that a picture needs no more than the weights of the sets: the
shader multiplies the albedo by 1 + weight * light of each channel, and moves the texture coordinate by weight * pull.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32, I64, U8
from vistel.figure.avatar.atlas_kernels import rasterise, spread
from vistel.figure.avatar.avatar import Avatar
from vistel.wrinkle.dressing import ChartedAvatar
from vistel.wrinkle.drives import Drives
from vistel.wrinkle.worn import Worn
from vistel.wrinkle.wrinkle_sets import WrinkleSet

Flags = NDArray[np.bool_]

log = logging.getLogger("vistel.wrinkle")

CHANNELS = 4
"""Colour channels of the picture of light."""
MOST_SETS = 63
"""Sets that fit into a shader's uniform array, besides the one that is always 0."""
PLAIN = 128
"""Value of a texel that is as bright as without wrinkles."""
COARSE = 4
"""Size of a texel of the picture from which the lit triangles are found, in texels of the albedo."""
MARGIN = 4
"""Texels by which light is spread beyond the islands of the texture."""
SLIGHT = 0.004
"""Weights below it move nothing."""


@dataclass(frozen=True, eq=False)
class LevelWrinkles:
    """Wrinkles of one level of detail, R drawn vertices.

    start: (S + 1,); vertex, height: those that set s moves, and how far along their normals [m], from start[s] on. sets: (R, 4) of
    each channel the set near the vertex, counted from 1, 0 none; pull: (R, 4) how far its texture coordinate moves up.
    """

    count: int
    start: I32
    vertex: I32
    height: F32
    sets: U8
    pull: F32

    def displacement(self, weights: F64) -> F32 | None:
        """(V,) of the skin along its normals [m]; None where nothing is wrinkled."""
        out: F32 | None = None
        for s in np.flatnonzero(weights > SLIGHT):
            a, b = self.start[s], self.start[s + 1]
            if a == b:
                continue
            if out is None:
                out = np.zeros(self.count, np.float32)
            out[self.vertex[a:b]] += np.float32(weights[s]) * self.height[a:b]
        return out


@dataclass(frozen=True, eq=False)
class ShownWrinkles:
    """Wrinkles of a figure. shape: of its albedo; texel: (N,) counted row by row, channel and light: (N,) of what is not PLAIN.
    memory: (S,) share of each set that stays for a while."""

    names: tuple[str, ...]
    drives: Drives
    memory: F64
    shape: tuple[int, int]
    texel: I32
    channel: U8
    light: U8
    levels: tuple[LevelWrinkles, ...]

    def picture(self) -> U8:
        """(H, W, 4) light of the channels, brightness less 1 in steps of 1 / 127.5 about PLAIN."""
        out = np.full((self.shape[0] * self.shape[1], CHANNELS), PLAIN, np.uint8)
        out[self.texel, self.channel] = self.light
        return out.reshape(*self.shape, CHANNELS)


def shown(made: ChartedAvatar, wears: Sequence[WrinkleSet]) -> ShownWrinkles:
    """The wrinkles of a charted avatar, on all its levels; takes some seconds. Sets beyond CHANNELS in one place or MOST_SETS in
    all are left out with a line in the log."""
    finest = Worn(made.avatar, wears, made.charts)
    worn = [finest, *(Worn(a, wears, made.charts, textures=False, finest=finest) for a in made.avatar.coarser)]
    near = [_near(w.avatar, finest) for w in worn]
    channel = _channels(finest, near)
    texel, channels, light = _light(finest, channel)
    return ShownWrinkles(
        tuple(s.name for s in finest.sets),
        finest.drives,
        np.where(channel < 0, 0.0, finest.memory),
        (made.avatar.albedo.shape[0], made.avatar.albedo.shape[1]),
        texel,
        channels,
        light,
        tuple(_level(w, n, channel) for w, n in zip(worn, near, strict=True)),
    )


def _near(avatar: Avatar, finest: Worn) -> list[Flags]:
    """Of each set (R,) whether it lights or moves anything at a drawn vertex."""
    mesh = avatar.mesh
    height, width = finest.avatar.albedo.shape[:2]
    size = -(-max(height, width) // COARSE)
    uv = mesh.uv.astype(np.float64) * np.array((width, height)) / (size * COARSE)
    uv[:, 1] += 1.0 - height / (size * COARSE)
    owner, _ = rasterise(uv, mesh.corner_triangles.astype(np.int64), size)
    out: list[Flags] = []
    for each in finest.sets:
        flags = np.zeros(len(mesh.uv), np.bool_)
        row, column = each.texel // width // COARSE, each.texel % width // COARSE
        faces = np.unique(owner[row, column]) if len(row) else np.zeros(0, np.int32)
        flags[mesh.corner_triangles[faces[faces >= 0]]] = True
        out.append(flags)
    return out


def _channels(finest: Worn, near: Sequence[Sequence[Flags]]) -> NDArray[np.int8]:
    """(S,) the channel of each set, -1 none; the largest are served first."""
    sets = finest.sets
    channel = np.full(len(sets), -1, np.int8)
    taken: list[list[int]] = [[] for _ in range(CHANNELS)]
    for s in sorted(range(len(sets)), key=lambda k: -len(sets[k].texel)):
        if s >= MOST_SETS:
            log.warning("event=wrinkles_left_out set=%s reason='more than %d sets'", sets[s].name, MOST_SETS)
            continue
        for c in range(CHANNELS):
            if not any((level[s] & level[o]).any() for level in near for o in taken[c]):
                channel[s] = c
                taken[c].append(s)
                break
        else:
            log.warning("event=wrinkles_left_out set=%s reason='over more than %d others'", sets[s].name, CHANNELS - 1)
    return channel


def _light(finest: Worn, channel: NDArray[np.int8]) -> tuple[I32, U8, U8]:
    """Texels, channels and light, with a margin round the islands of the texture, so that seams do not show."""
    height, width = finest.avatar.albedo.shape[:2]
    owned = finest.covered()
    texels: list[I64] = []
    channels: list[U8] = []
    lights: list[U8] = []
    for c in range(CHANNELS):
        picture = np.full(height * width, PLAIN, np.uint8)
        for s in np.flatnonzero(channel == c):
            each = finest.sets[s]
            picture[each.texel] = np.clip(np.rint(PLAIN + 127.5 * (each.light - 1.0)), 0, 255).astype(np.uint8)
        if (picture == PLAIN).all():
            continue
        three = np.repeat(picture.reshape(height, width, 1), 3, axis=2)
        spread(three, owned.copy(), MARGIN)
        found = np.flatnonzero(three[..., 0] != PLAIN)
        texels.append(found)
        channels.append(np.full(len(found), c, np.uint8))
        lights.append(three[..., 0].ravel()[found])
    if not texels:
        return np.zeros(0, np.int32), np.zeros(0, np.uint8), np.zeros(0, np.uint8)
    return np.concatenate(texels).astype(np.int32), np.concatenate(channels), np.concatenate(lights)


def _level(worn: Worn, near: Sequence[Flags], channel: NDArray[np.int8]) -> LevelWrinkles:
    corners = len(worn.avatar.mesh.uv)
    sets, pull = np.zeros((corners, CHANNELS), np.uint8), np.zeros((corners, CHANNELS), np.float32)
    for s, each in enumerate(worn.sets):
        c = channel[s]
        if c < 0:
            continue
        sets[near[s], c] = s + 1
        if len(each.drawn):
            # Cloth also moves where its wrinkles change no light and no other set moves it.
            free = (sets[each.drawn, c] == 0) | (sets[each.drawn, c] == s + 1)
            sets[each.drawn[free], c] = s + 1
            pull[each.drawn[free], c] = each.shift[free, 1]
    start = np.cumsum([0, *(len(each.vertex) for each in worn.sets)]).astype(np.int32)
    return LevelWrinkles(
        len(worn.avatar.mesh.vertices),
        start,
        np.concatenate([start[:0], *(e.vertex for e in worn.sets)]).astype(np.int32),
        np.concatenate([pull[:0, 0], *(e.height for e in worn.sets)]).astype(np.float32),
        sets,
        pull,
    )

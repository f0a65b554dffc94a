"""Hair of a person, of eight styles."""

from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64, Bool
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.patch import Patch
from vistel.figure.body_model.hair.cap import cap, ground
from vistel.figure.body_model.hair.cards import Strips, cards, mesh_of
from vistel.figure.body_model.hair.growth import ROWS, along, grown, pushed_out
from vistel.figure.body_model.hair.scalp import Roots, Scalp
from vistel.figure.body_model.hair.strands import MIDDLE, OUTER, cap_box, lock_box, painted, strands
from vistel.figure.body_model.hair.styles import STYLES, Style, bun_of
from vistel.figure.part import Part
from vistel.geometry.smoothstep import smooth

MOST = 3000, 1200, 350
"""Vertices of hair by level of detail."""
_NET = (40, 8), (40, 7), (26, 5)
"""Columns and rows of a cap, by level."""
_CLEAR = 0.0012
"""Least distance of hair from the skin [m]."""
_SHOULDERS = 0.05
"""From the base of the neck down to where hair is as far off as on shoulders [m]."""
_ROUGHNESS = 0.62
_HELD = 0.15
"""So far below the eyes the skull holds hair; from there on it hangs free, as a share of the head's size."""
_COVERED = 0.28
"""So far inside the hairline no skin is seen through the cap, as a share of the head's size."""


def hair(
    body: Avatar,
    style: str,
    colour: tuple[float, float, float],
    rng: np.random.Generator,
    *,
    grey: float = 0.0,
    receding: float = 0.0,
    over: float = 0.0,
) -> Part | None:
    """Hair for a body in the T-pose as `vistel.figure.body_model.assemble` makes it, with all its levels; None if it is shaved,
    which is paint on the scalp. style: one of `STYLES`; colour: sRGB 0 to 255; grey: share of strands without colour; receding: 0
    to 1, how far the hairline is drawn back at the temples; over: how thick is what shoulders wear [m]. Raises ValueError, one
    line, for a style that is not known."""
    if style not in STYLES:
        raise ValueError(f"hair: expected one of {', '.join(STYLES)}, got {style!r}")
    made = STYLES[style]
    if made is None:
        return None
    scalp = Scalp(body, receding)
    locks = _grown(scalp, made, rng)
    seed = int(rng.integers(1 << 31))
    limb = body.body.names.index("skull")
    levels = tuple(_level(scalp, made, locks, k, seed, limb, over) for k in range(1 + len(body.coarser)))
    drawn = strands(made.kind)
    patch = Patch(roughness=_ROUGHNESS, normal=drawn.normal, opacity=drawn.opacity, cutoff=0.35, both_sides=True, strands=True)
    hides = tuple(_covered(scalp, level.mesh) for level in (body, *body.coarser))
    return Part(f"{style} hair", levels, painted(made.kind, colour, grey, rng), (patch,), hides)


def _covered(scalp: Scalp, mesh: Mesh) -> Bool:
    """(F,) triangles of the body that lie under the cap where it is opaque."""
    under = scalp.within(mesh) > _COVERED * scalp.size
    return np.asarray(under[mesh.triangles].all(axis=1))


@dataclass(frozen=True, eq=False)
class _Locks:
    """Cards before they have a width in a level: curve, out (N, ROWS, 3); box (N, 4); width (N,) [m]; order: (N,) from 0, the place
    among those of the same layer, as a share of them: coarser levels have the first."""

    curve: F64
    out: F64
    box: F64
    width: F64
    order: F64


def _grown(scalp: Scalp, style: Style, rng: np.random.Generator) -> _Locks:
    size = scalp.size
    if not style.counts[0]:
        none = np.zeros((0, ROWS, 3))
        return _Locks(none, none, np.zeros((0, 4)), np.zeros(0), np.zeros(0))
    counts = [round(layer.share * style.counts[0]) for layer in style.layers]
    roots = [
        scalp.roots(n, rng, layer.least * size, layer.most * size, style.dense)
        for n, layer in zip(counts, style.layers, strict=True)
    ]
    of = np.repeat(np.arange(len(roots)), [len(r) for r in roots])
    order = np.concatenate([np.arange(len(r)) / len(r) for r in roots])
    every = Roots.together(roots)
    lift, wide = (np.array([getattr(layer, name) for layer in style.layers])[of] for name in ("lift", "wide"))
    growth = replace(style.growth(scalp, every, lift, rng), cap=(style.cap, *style.shells)[-1])
    curve, out = grown(scalp, every, growth, rng)
    column = np.array([rng.choice(style.layers[k].columns) for k in of])
    return _Locks(curve, out, _boxes(column, rng), style.width * wide * (size / 0.095) * rng.uniform(0.8, 1.2, len(of)), order)


def _level(scalp: Scalp, style: Style, locks: _Locks, level: int, seed: int, limb: int, over: float) -> Mesh:
    level = min(level, len(MOST) - 1)
    parts = _caps(scalp, style, level)
    if style.tied:
        parts.append(_bun(scalp, level, np.random.default_rng(seed)))
    rows, across = style.rows[level], 3 if level == 0 and style.tied else 2
    room = (MOST[level] - sum(len(part.p) for part in parts)) // (rows * across)
    first = np.argsort(locks.order, kind="stable")[: max(0, min(style.counts[level], room))]
    on = np.sort(first)[::-1]
    if len(on):
        # Heads are round: more places near the root.
        at = np.linspace(0.0, 1.0, rows) ** (1.35 if style.hanging else 1.0)
        s = np.broadcast_to((ROWS - 1.0) * at, (len(on), rows))
        wider = (len(locks.order) / len(on)) ** 0.45
        wide = wider * locks.width[on, None] * np.interp(at, (0.0, 0.25, 1.0), (0.4, 1.0, 0.85))
        arch = 0.14 if style.hanging else 0.06
        parts.append(cards(along(locks.curve[on], s), along(locks.out[on], s), at, wide, locks.box[on], across, arch))
    # Cards are wide and flat, bodies are round. What lies outside is drawn first and hides the rest before it is lit.
    clear = [_CLEAR + over * smooth((scalp.neck[1] + 0.02 - part.p[:, 1]) / _SHOULDERS) for part in parts]
    off = [replace(part, p=pushed_out(scalp, part.p, least)) for part, least in zip(parts, clear, strict=True)]
    made = mesh_of(scalp, off[::-1], limb)
    if not style.hanging:
        return made
    held = scalp.eyes[1] - _HELD * scalp.size
    return replace(made, hangs=np.maximum(0.0, held - made.vertices[:, 1]).astype(np.float32))


def _caps(scalp: Scalp, style: Style, level: int) -> list[Strips]:
    """The cap, and shells over it."""
    columns, rows = (60, 11) if style.round and level == 0 else _NET[level]
    skin = ground(scalp, columns, rows)
    shells = style.shells if level == 0 else style.shells[-1:] if level == 1 else ()
    return [cap(scalp, skin, high, cap_box(shell=k > 0)) for k, high in enumerate((style.cap, *shells))]


def _boxes(column: F64, rng: np.random.Generator) -> F64:
    """(N, 4) of locks; every other one the other way round."""
    box = np.array([lock_box(int(c)) for c in column])
    turned = rng.random(len(box)) < 0.5
    box[turned] = box[turned][:, [2, 1, 0, 3]]
    return box


def _bun(scalp: Scalp, level: int, rng: np.random.Generator) -> Strips:
    """Locks wound round a ball."""
    middle, radius = bun_of(scalp), 0.36 * scalp.size
    count, rows = ((26, 8), (12, 6), (6, 5))[min(level, 2)]
    axis = (middle - scalp.middle) / np.linalg.norm(middle - scalp.middle)
    side = np.cross(axis, (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    up = np.cross(side, axis)
    start = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False) + rng.normal(0.0, 0.1, count)
    s = np.linspace(0.0, 1.0, rows)
    around = start[:, None] + 2.4 * s * rng.uniform(0.8, 1.2, count)[:, None]
    polar = 0.72 * np.pi * (1.0 - s) + 0.06 * np.pi + rng.normal(0.0, 0.05, count)[:, None]
    unit = np.cos(polar)[..., None] * axis + np.sin(polar)[..., None] * (
        np.cos(around)[..., None] * side + np.sin(around)[..., None] * up
    )
    curve = middle + radius * unit * rng.uniform(0.94, 1.06, count)[:, None, None]
    wide = np.full((count, rows), 2.0 * np.pi * radius * 1.9 / count) * np.interp(s, (0.0, 0.5, 1.0), (0.8, 1.0, 0.5))
    box = np.array([lock_box(int(c)) for c in rng.choice((*MIDDLE, *OUTER), count)])
    return cards(curve, unit, s, wide, box, 3 if level == 0 else 2, 0.06)

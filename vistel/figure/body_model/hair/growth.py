"""Guide curves: hair grows from its roots, combed, falls, and lies on the skin without passing through it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, Bool
from vistel.figure.body_model.hair.cap import Cap
from vistel.figure.body_model.hair.scalp import Roots, Scalp
from vistel.geometry.smoothstep import smooth

_STEPS = 26
"""Of a curve while it grows."""
ROWS = 24
"""Places of a curve."""
_LIGHT = 0.2
"""Weight of hair up to which it stands by itself; at twice that it lies."""
_ROOM = 0.004
"""How far off it lies, so that wide locks do not cut into the cap [m]."""
_EDGE = 0.5
"""How far inside the hairline it lies throughout, as a share of the head's size."""
_TOP = 0.7
"""How high above the middle of the skull that is so throughout, as a share of the head's size; below the middle hair falls."""
_FACE = 0.9
"""Azimuth up to which hair falls into the face [rad]."""
_NONE = Cap(0.0)
_DOWN = np.array((0.0, -1.0, 0.0))
Comb = Callable[[Scalp, F64, Roots], F64]
"""Which way hair is combed at places (N, 3) of curves that began at the roots: (N, 3) of any length."""


@dataclass(frozen=True, eq=False)
class Growth:
    """How curves grow. length: (N,) [m]; end: (N,) height at which they are cut [m]; lift: (N,) how far they stand off the cap at
    most [m]; rise: cosine of the way out of the skin at the root; stiff: share of its own way that a curve keeps from step to step;
    weight: how hard it falls against how hard it is combed, 0 where it is tied; curl: (radius [m], turns per metre); cap: over
    which they grow; beyond: how far past the hairline they go beside and behind the face [m], where it is trimmed."""

    comb: Comb
    length: F64
    end: F64
    lift: F64
    rise: float = 0.3
    stiff: float = 0.6
    weight: float = 0.25
    curl: tuple[float, float] = (0.0, 0.0)
    cap: Cap = _NONE
    beyond: float = np.inf


def grown(scalp: Scalp, roots: Roots, growth: Growth, rng: np.random.Generator) -> tuple[F64, F64]:
    """(N, ROWS, 3) places of curves, evenly spaced from the root, and (N, ROWS, 3) unit the way out of the head there."""
    # From just under the cap's surface, so that no curve comes out of it like a peg.
    p = roots.p + 0.9 * growth.cap.height(scalp, roots.p, roots.inside)[:, None] * roots.normal
    step = growth.length / _STEPS
    way = _turned(growth.comb(scalp, p, roots), roots.normal, growth.rise)
    near, normal = np.zeros(len(p)), roots.normal
    path, out = [p], [normal]
    taken = np.full(len(roots), _STEPS)
    # Along the hairline locks hide its edge.
    lies = float(smooth((growth.weight - _LIGHT) / _LIGHT)) * smooth(roots.inside / (_EDGE * scalp.size))
    for k in range(_STEPS):
        # Ears are pressed by hair that lies over them.
        lift = growth.lift * (1.0 - 0.65 * smooth((scalp.middle[1] - p[:, 1]) / (0.5 * scalp.size)))
        wish = _tangent(growth.comb(scalp, p, roots), normal)
        free = np.clip((near - lift) / (0.15 * scalp.size), 0.0, 1.0)[:, None]
        wish = wish * (1.0 - 0.85 * free * (growth.weight > 0.0)) + (growth.weight + 0.6 * free * (growth.weight > 0.0)) * _DOWN
        # What lies on something slides along it.
        wish -= (1.0 - free) * np.minimum(0.0, np.einsum("ni,ni->n", wish, normal))[:, None] * normal
        way = _unit(growth.stiff * way + (1.0 - growth.stiff) * wish)
        moved = p + step[:, None] * way
        near, normal = scalp.skin(moved)
        # Off the skin by more and more from the root on, and no deeper than that anywhere.
        high = growth.cap.height(scalp, moved, scalp.inside(moved))
        deep = high + lift * float(smooth((k + 2.0) / (0.6 * _STEPS))) - near
        # On top of a head hair that hangs lies: its steps are long, and straight ones would leave what is round.
        top = smooth((moved[:, 1] - scalp.middle[1]) / (_TOP * scalp.size))
        deep = np.maximum(-lies * top * np.maximum(0.0, -deep - _ROOM), deep)
        moved += deep[:, None] * normal
        near += deep
        way = _unit(moved - p + 1e-9)
        cut = taken < k
        moved = np.where(cut[:, None], p, moved)
        taken = np.where(~cut & ((moved[:, 1] < growth.end) | _past(scalp, moved, growth.beyond)), np.minimum(taken, k + 1), taken)
        p = moved
        path.append(p)
        out.append(normal)
    at = taken[:, None] * np.linspace(0.0, 1.0, ROWS)
    curve, facing = (along(np.stack(a, axis=1), at) for a in (path, out))
    radius, turns = growth.curl
    if radius:
        curve = _curled(curve, radius, turns, growth.length, rng)
        curve[:, 1:] = pushed_out(scalp, curve[:, 1:].reshape(-1, 3), np.array(0.002)).reshape(len(curve), -1, 3)
    return curve, _facing(scalp, curve, facing)


def _past(scalp: Scalp, p: F64, beyond: float) -> Bool:
    """(N,) whether places (N, 3) are farther past the hairline than that, beside and behind the face."""
    return (scalp.inside(p) < -beyond) & (np.abs(scalp.angles(p)[0]) > _FACE)


def pushed_out(scalp: Scalp, p: F64, least: F64) -> F64:
    """Places (N, 3) brought at least that far off the skin, (N,) or () [m]."""
    for vertices in (4, 1, 1):
        near, normal = scalp.skin(p, vertices)
        p = p + np.maximum(0.0, least - near)[:, None] * normal
    return p


def _facing(scalp: Scalp, curve: F64, normal: F64) -> F64:
    """The way out of a head: of the skin where it is near, away from the neck's axis where hair hangs free, evened along curves."""
    axis = np.array((0.0, 0.0, 0.6 * scalp.middle[2] + 0.4 * scalp.neck[2]))
    aside = (curve - axis) * (1.0, 0.0, 1.0)
    aside /= np.maximum(np.linalg.norm(aside, axis=2, keepdims=True), 1e-6)
    radial = curve - scalp.middle
    radial /= np.maximum(np.linalg.norm(radial, axis=2, keepdims=True), 1e-6)
    low = np.clip((scalp.middle[1] - curve[..., 1]) / (0.5 * scalp.size), 0.0, 1.0)[..., None]
    out = 0.35 * normal + 0.65 * (low * aside + (1.0 - low) * radial)
    for _ in range(2):
        out[:, 1:-1] = 0.5 * out[:, 1:-1] + 0.25 * (out[:, :-2] + out[:, 2:])
    return out / np.maximum(np.linalg.norm(out, axis=2, keepdims=True), 1e-9)


def _curled(curve: F64, radius: float, turns: float, length: F64, rng: np.random.Generator) -> F64:
    """The curves wound about themselves, more and more from the root on."""
    count, rows, _ = curve.shape
    along = _unit(np.gradient(curve, axis=1))
    side = _unit(np.cross(along, np.array((0.3, 0.9, 0.2))))
    up = np.cross(along, side)
    s: F64 = np.linspace(0.0, 1.0, rows)
    start: F64 = rng.uniform(0.0, 2.0 * np.pi, (count, 1))
    phase: F64 = start + 2.0 * np.pi * turns * length[:, None] * s
    size: F64 = rng.uniform(0.6, 1.3, (count, 1))
    wide: F64 = radius * np.minimum(1.0, 3.0 * s) * size
    return curve + wide[..., None] * (np.cos(phase)[..., None] * side + np.sin(phase)[..., None] * up)


def along(path: F64, at: F64) -> F64:
    """(N, R, 3) of paths (N, K, 3) at places at (N, R) between their steps."""
    low = np.clip(np.floor(at).astype(int), 0, path.shape[1] - 2)
    share = (at - low)[..., None]
    row = np.arange(len(path))[:, None]
    return path[row, low] * (1.0 - share) + path[row, low + 1] * share


def _tangent(wish: F64, normal: F64) -> F64:
    return _unit(wish - np.einsum("ni,ni->n", wish, normal)[:, None] * normal)


def _turned(wish: F64, normal: F64, rise: float) -> F64:
    return _unit(np.sqrt(1.0 - rise * rise) * _tangent(wish, normal) + rise * normal)


def _unit(v: F64) -> F64:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)

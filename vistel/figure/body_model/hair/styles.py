"""Styles of hair: how it is combed, how long it is, and in which layers its cards lie."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.body_model.hair.cap import Cap
from vistel.figure.body_model.hair.growth import Comb, Growth
from vistel.figure.body_model.hair.scalp import Density, Roots, Scalp
from vistel.figure.body_model.hair.strands import INNER, MIDDLE, OUTER, WISPS
from vistel.geometry.smoothstep import smooth


@dataclass(frozen=True)
class Layer:
    """Cards of one depth. share: of the style's cards; lift: of its full lift; columns: of the picture; least: how far inside the
    hairline they begin, as a share of the head's size; most: the same, up to where."""

    share: float
    lift: float
    columns: tuple[int, ...]
    wide: float = 1.0
    least: float = 0.0
    most: float = 9.0


_LAYERS = (
    Layer(0.30, 0.15, INNER, 1.2, 0.14), Layer(0.34, 0.55, MIDDLE, 1.0, 0.12), Layer(0.20, 0.8, OUTER, 0.9, 0.12),
    Layer(0.16, 0.35, WISPS, 0.8, 0.05, 0.16),
)  # fmt: skip
"""Within, between, outside, and fine hair along the hairline."""


_HANGING = (
    Layer(0.34, 0.30, INNER, 1.25, 0.08), Layer(0.36, 0.65, MIDDLE, 1.0, 0.07), Layer(0.16, 1.0, OUTER, 0.9, 0.10),
    Layer(0.14, 0.45, MIDDLE, 0.9, 0.06, 0.16),
)  # fmt: skip


@dataclass(frozen=True)
class Style:
    """A style. Lengths are for a head of size 0.095 m and grow with it. kind: of strands; cap, shells: what is opaque under the
    cards, and thin ones over it, the highest last; round: whether the highest
    is finer than the skin; hanging, tied: what becomes of long hair; width: of
    cards [m]; counts, rows: of cards, and of places along each, by level; dense: where there
    are more roots; growth: how curves grow from roots (lift: of the layer)."""

    kind: str
    cap: Cap
    width: float
    counts: tuple[int, int, int]
    rows: tuple[int, int, int]
    growth: Callable[[Scalp, Roots, F64, np.random.Generator], Growth]
    layers: tuple[Layer, ...] = _LAYERS
    dense: Density | None = None
    shells: tuple[Cap, ...] = ()
    round: bool = False
    hanging: bool = False
    tied: bool = False


def _from_whorl(scalp: Scalp, p: F64, roots: Roots) -> F64:
    """Away from the whorl: forwards on top, down at the sides and the back."""
    way = _unit(p - scalp.middle) - scalp.whorl
    aside = np.clip(np.abs(p[:, 0]) / scalp.size - 0.45, 0.0, 0.3)
    return _unit(way) + np.column_stack([np.zeros(len(p)), -1.3 * aside, -1.3 * aside])


def _brushed(scalp: Scalp, p: F64, roots: Roots) -> F64:
    """As from the whorl, in front to one side and up."""
    front = smooth((np.cos(roots.azimuth) * np.cos(roots.elevation) - 0.1) / 0.5)[:, None]
    temple = np.exp(-np.square((np.abs(roots.azimuth) - 0.95) / 0.35)) * smooth(1.0 - roots.inside / (0.6 * scalp.size))
    return _from_whorl(scalp, p, roots) + front * np.array((-0.9, 0.35, -0.1)) + temple[:, None] * np.array((0.0, -0.9, -1.1))


PARTING = 0.42
"""Of a side parting: left of the middle, as a share of the head's size."""


def _parted(at: float, back: float) -> Comb:
    def comb(scalp: Scalp, p: F64, roots: Roots) -> F64:
        """To either side of a parting, which ends at the whorl, behind which hair falls; in front also back."""
        side = np.where(roots.p[:, 0] > _line_of(scalp, at, roots), 1.0, -1.0)
        behind = smooth((0.1 * scalp.size + scalp.middle[2] - roots.p[:, 2]) / (1.0 * scalp.size))[:, None]
        low = smooth((scalp.middle[1] + 0.35 * scalp.size - p[:, 1]) / (0.5 * scalp.size))
        # Past the temples hair goes back, away from the face.
        face = smooth((p[:, 2] - scalp.middle[2] - 0.1 * scalp.size) / (0.4 * scalp.size))
        across = side * (1.0 - 0.75 * low)
        parted = np.column_stack([across, -0.75 - 0.5 * low, -back * (1.0 - 0.5 * low) - 0.9 * face * (0.45 + 0.55 * low)])
        return _over_shoulders(scalp, p, roots, (1.0 - behind) * parted + behind * _from_whorl(scalp, p, roots))

    return comb


def _over_shoulders(scalp: Scalp, p: F64, roots: Roots, way: F64) -> F64:
    """The way past the neck: hair of the front hangs before the shoulders, other hair behind them, and none over the arms."""
    low = smooth((scalp.eyes[1] - 0.9 * scalp.size - p[:, 1]) / (0.5 * scalp.size))[:, None]
    far = np.clip(np.abs(p[:, 0]) - 0.78 * scalp.size, -0.1 * scalp.size, 0.5 * scalp.size) / scalp.size
    before = np.where(np.abs(roots.azimuth) < 0.9, 1.0, -1.0)
    past = np.column_stack([-6.0 * np.sign(p[:, 0]) * np.maximum(0.0, far), np.full(len(p), -1.0), 0.9 * before])
    return (1.0 - low) * way + low * past


def _line_of(scalp: Scalp, at: float, roots: Roots) -> F64:
    """(N,) the parting's place across the head [m] at the roots: at the whorl it is in the middle."""
    return at * scalp.size * smooth((roots.p[:, 2] - scalp.middle[2] + 0.6 * scalp.size) / (0.5 * scalp.size))


def _at_parting(at: float) -> Density:
    def dense(scalp: Scalp, roots: Roots) -> F64:
        """Most roots along a parting and about the whorl: from there hair covers the rest."""
        behind = np.maximum(0.0, scalp.middle[2] + 0.45 * scalp.size * scalp.whorl[2] - roots.p[:, 2])
        away = np.hypot(roots.p[:, 0] - _line_of(scalp, at, roots), behind) / scalp.size
        crown = np.linalg.norm(_unit(roots.p - scalp.middle) - scalp.whorl, axis=1)
        spread = np.exp(-np.square(away / 0.22)) + 0.7 * np.exp(-np.square(crown / 0.45))
        return 1.0 + 5.0 * spread - 0.4 * smooth((away - 0.5) / 0.4)

    return dense


def _on_crown(scalp: Scalp, roots: Roots) -> F64:
    """More roots on top, where curls are seen, than where others hang over."""
    return 0.6 + 1.2 * _on_top(roots)


def _to_bun(scalp: Scalp, p: F64, roots: Roots) -> F64:
    return _unit(bun_of(scalp) - p)


def bun_of(scalp: Scalp) -> F64:
    """(3,) the middle of a bun [m]."""
    return scalp.middle + scalp.size * 1.22 * np.array((0.0, 0.30, -0.954))


def _lengths(scalp: Scalp, roots: Roots, length: F64 | float, rng: np.random.Generator, spread: float = 0.14) -> F64:
    return length * np.clip(rng.normal(1.0, spread, len(roots)), 0.6, 1.4) * (scalp.size / 0.095)


def _nowhere(roots: Roots) -> F64:
    return np.full(len(roots), -np.inf)


def _on_top(roots: Roots) -> F64:
    """(N,) 1 on top of the head, 0 at its sides and its back."""
    return smooth((roots.elevation - np.radians(22.0)) / np.radians(26.0))


def _cropped(scalp: Scalp, roots: Roots, lift: F64, rng: np.random.Generator) -> Growth:
    length = _lengths(scalp, roots, 0.010 + 0.006 * _on_top(roots), rng)
    return Growth(_from_whorl, length, _nowhere(roots), 0.003 * lift, 0.45, weight=0.05)


_TRIMMED = 0.003
"""How far short hair goes past the hairline at ears and nape [m]."""


def _short(scalp: Scalp, roots: Roots, lift: F64, rng: np.random.Generator) -> Growth:
    top = _on_top(roots)
    edge = smooth(roots.inside / (0.5 * scalp.size))
    length = _lengths(scalp, roots, (0.046 + 0.014 * top) * (0.3 + 0.7 * edge), rng)
    return Growth(
        _brushed, length, _nowhere(roots), lift * (0.003 + 0.003 * top) * (0.4 + 0.6 * edge), 0.04, weight=0.05, beyond=_TRIMMED
    )


def _side_parting(scalp: Scalp, roots: Roots, lift: F64, rng: np.random.Generator) -> Growth:
    top = _on_top(roots)
    edge = np.maximum(top, smooth(roots.inside / (0.5 * scalp.size)))
    length = _lengths(scalp, roots, (0.046 + 0.052 * top) * (0.35 + 0.65 * edge), rng)
    return Growth(_parted(PARTING, 0.45), length, _nowhere(roots), lift * (0.003 + 0.004 * top), 0.08, weight=0.1, beyond=_TRIMMED)


def _curly(scalp: Scalp, roots: Roots, lift: F64, rng: np.random.Generator) -> Growth:
    turn = rng.normal(0.0, 0.8, (len(roots), 3))

    def comb(scalp: Scalp, p: F64, roots: Roots) -> F64:
        return _from_whorl(scalp, p, roots) + turn

    edge = smooth(roots.inside / (0.5 * scalp.size))
    length = _lengths(scalp, roots, 0.028 + 0.042 * edge, rng, 0.15)
    return Growth(comb, length, _nowhere(roots), lift * (0.003 + 0.009 * edge), 0.5, 0.7, weight=0.15, curl=(0.007, 17.0))


def _hanging(scalp: Scalp, roots: Roots, lift: F64, rng: np.random.Generator, end: float, curl: tuple[float, float]) -> Growth:
    length = _lengths(scalp, roots, 1.05 * (scalp.eyes[1] + 1.1 * scalp.size - end) + 0.06, rng, 0.05)
    ends = end + rng.normal(0.0, 0.006, len(roots)) + 0.004
    edge = smooth(roots.inside / (0.3 * scalp.size))
    return Growth(_parted(0.12, 0.35), length, ends, 0.009 * lift * (0.35 + 0.65 * edge), 0.25, weight=0.45, curl=curl)


def _bob(scalp: Scalp, roots: Roots, lift: F64, rng: np.random.Generator) -> Growth:
    return _hanging(scalp, roots, lift, rng, scalp.eyes[1] - 1.18 * scalp.size, (0.0, 0.0))


def _long(scalp: Scalp, roots: Roots, lift: F64, rng: np.random.Generator) -> Growth:
    return _hanging(scalp, roots, lift, rng, scalp.neck[1] - 1.5 * scalp.size, (0.004, 6.0))


def _bun(scalp: Scalp, roots: Roots, lift: F64, rng: np.random.Generator) -> Growth:
    length = 1.1 * np.linalg.norm(bun_of(scalp) - roots.p, axis=1)
    return Growth(_to_bun, length, _nowhere(roots), 0.0035 * lift, 0.04, 0.35, weight=0.0)


STYLES: dict[str, Style | None] = {
    "shaved": None,
    "cropped": Style(
        "stubs", Cap(0.0020), 0.010, (0, 0, 0), (3, 3, 2), _cropped,
        shells=(Cap(0.0033, 0.001), Cap(0.0045, 0.0020), Cap(0.0057, 0.0030)), round=True,
    ),
    "short": Style(
        "tufts", Cap(0.0030, 0.006), 0.016, (120, 66, 24), (5, 4, 3), _short,
        shells=(Cap(0.0050, 0.009, 0.001), Cap(0.0070, 0.012, 0.002)),
    ),
    "side_parting": Style(
        "tufts", Cap(0.0030, 0.006), 0.020, (120, 90, 24), (5, 4, 3), _side_parting, dense=_at_parting(PARTING),
        shells=(Cap(0.0050, 0.009, 0.001), Cap(0.0070, 0.011, 0.002)),
    ),
    "curly": Style(
        "curly", Cap(0.0080, 0.004, 0.004), 0.016, (73, 62, 14), (7, 6, 4), _curly,
        dense=_on_crown, shells=(Cap(0.0120, 0.006, 0.006),),
    ),
    "bob": Style("straight", Cap(0.0020, 0.005), 0.023, (150, 90, 26), (8, 5, 4), _bob, _HANGING, _at_parting(0.12), hanging=True),
    "long": Style("wavy", Cap(0.0020, 0.005), 0.029, (128, 75, 24), (10, 6, 4), _long, _HANGING, _at_parting(0.12), hanging=True),
    "bun": Style("straight", Cap(0.0020), 0.022, (76, 70, 16), (6, 4, 3), _bun, round=True, tied=True),
}  # fmt: skip
"""By name, from shaved, which is paint on the scalp, to long and tied."""


def _unit(v: F64) -> F64:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)

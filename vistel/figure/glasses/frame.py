"""Frames and lenses of glasses that sit on one head: rims, bridge, end pieces, and temples that hook over its ears."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vistel.arrays import F64
from vistel.figure.glasses.head import Ear, Head
from vistel.figure.glasses.tubes import Shape, bar, carried, joined


@dataclass(frozen=True)
class Style:
    """round: how round a lens is: 2 an ellipse, more the nearer to a rectangle. high: its height as a share of its width. low: of
    its middle below the pupil; wide, deep: half the size of a rim across the lens and to the front; temple: half a temple's height
    [m, a standard head]. below: whether the rim goes all round."""

    round: float
    high: float
    low: float
    wide: float
    deep: float
    temple: float
    below: bool = True


@dataclass(frozen=True)
class Fineness:
    """How many places a rim, half a bridge and a temple have, and rings of a lens; 0: it has none."""

    rim: int
    bridge: int
    temple: int
    lens: int


_BRIDGES = 0.0070, 0.0120
"""Half the distance of the lenses, at least and at most [m, a standard head]."""
_HALF_LENS = 0.0255
"""Half the width of a lens, at most [m, a standard head]."""
_BESIDE = 0.0035
"""How far the middle of a lens is outside the pupil, at most [m, a standard head]."""
_BEFORE_EYES = 0.0255, 0.0310
"""How far before the middle of the eyes the front is at least, and at most if a nose lets it [m, a standard head]."""
_CLEAR = 0.0022
"""Between skin and what is before it, at least; expressions move the skin [m, a standard head]."""
_WRAP = 1.35
"""How much the front is bent round the face [1/m, a standard head]."""
_TILT = np.tan(np.radians(6.0))
"""Lenses look down a little."""
_DOME = 0.0018
"""How far a lens bulges [m, a standard head]."""
_HINGE = 0.30
"""How high over the middle of the lens temples begin, as a share of its height."""
_BRIDGE = 0.22
"""How high its ends are, in the same way."""
_END_PIECE = 0.0045
"""From the rim out to the hinge, at least [m, a standard head]."""
_HOOK = ((-0.0070, -0.0035), (-0.0150, -0.0085), (-0.0300, -0.0105))
"""Of the end behind an ear: below its top and behind its back [m, a standard head]."""
_OFF_TEMPLES = 0.0007
_THIN = 0.0008
"""Half the thickness of a temple [m, a standard head]."""
_FLESH_M = 0.0030
"""Skin so near beside a temple keeps it off [m, a standard head]."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A pair of glasses on a head, places from the middle between the eyes [m]. gap: half the distance of the lenses; forward: z of
    the front in the middle."""

    head: Head
    style: Style
    gap: float
    forward: float

    @staticmethod
    def fitted(head: Head, style: Style) -> "Frame":
        """The one with the narrowest bridge that lets it sit as near to the eyes as glasses do; else the nearest."""
        tried = [Frame(head, style, float(gap), 0.0) for gap in head.scale * np.linspace(*_BRIDGES, 6)]
        tried = [replace(frame, forward=max(frame._least, _BEFORE_EYES[0] * head.scale)) for frame in tried]
        near = [frame for frame in tried if frame.forward <= _BEFORE_EYES[1] * head.scale]
        return near[0] if near else min(tried, key=lambda f: f.forward + f.gap)

    @property
    def half_lens(self) -> float:
        """Half the width of a lens [m]."""
        return min(self.head.half - self.gap + _BESIDE * self.head.scale, _HALF_LENS * self.head.scale)

    @property
    def middle(self) -> F64:
        """(2,) of the left lens, aside and up [m]."""
        return np.array((self.gap + self.half_lens, -self.style.low * self.head.scale))

    @property
    def high(self) -> float:
        """Half the height of a lens [m]."""
        return self.style.high * self.half_lens

    def _bent(self, x: F64, y: F64) -> F64:
        """(N,) z of the front against its middle's, at places (N,) [m]."""
        return -_WRAP / self.head.scale * x * x + _TILT * (y - self.middle[1])

    def _front(self, flat: F64, before: float = 0.0) -> F64:
        """(N, 3) of places (N, 2) of the front."""
        x, y = flat[:, 0], flat[:, 1]
        return np.column_stack([x, y, self.forward + self._bent(x, y) + before])

    def _outline(self, count: int, grown: float = 0.0) -> F64:
        """(N, 2) places evenly round the left lens, counter-clockwise from its outer side."""
        turn = np.linspace(0.0, 2.0 * np.pi, 721)
        c, s = np.cos(turn), np.sin(turn)
        power = 2.0 / self.style.round
        half = np.array((self.half_lens, self.high)) + grown
        p = half * np.column_stack([np.sign(c) * np.abs(c) ** power, np.sign(s) * np.abs(s) ** power])
        way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1)))
        at = np.linspace(0.0, float(way[-1]), count, endpoint=False)
        return self.middle + np.column_stack([np.interp(at, way, p[:, k]) for k in range(2)])

    @cached_property
    def _least(self) -> float:
        """The least `forward` with which nothing of the front is nearer to the skin than it may be."""
        head, style, scale = self.head, self.style, self.head.scale
        q = head.skin
        x, y = np.abs(q[:, 0]), q[:, 1]
        room = (style.wide + 0.002) * scale
        aside, up = np.abs(x - self.middle[0]) / (self.half_lens + room), np.abs(y - self.middle[1]) / (self.high + room)
        before_lens = aside**style.round + up**style.round < 1.0
        on_bridge = (x < self.gap) & (np.abs(y - self._bridge_at(x)) < 0.004 * scale)
        covered = (before_lens | on_bridge) & (q[:, 2] > -0.03 * scale)
        return float((q[covered, 2] - self._bent(x[covered], y[covered])).max()) + (style.deep + _CLEAR) * scale

    def _bridge_at(self, x: F64) -> F64:
        """(N,) height of the bridge."""
        arch = 0.14 * self.high
        return self.middle[1] + _BRIDGE * self.high + arch * (1.0 - np.square(x / self.gap))

    def shape(self, fineness: Fineness) -> Shape:
        """All but the lenses."""
        bars = [self._bridge(fineness.bridge)]
        for sign, ear in zip((1.0, -1.0), self.head.ears, strict=True):
            mirror = np.array((sign, 1.0, 1.0))
            for p, tri in (self._rim(fineness.rim), self._temple(fineness.temple, ear, sign)):
                bars.append((p * mirror, tri if sign > 0.0 else tri[:, ::-1]))
        return joined(bars)

    def lenses(self, fineness: Fineness) -> Shape:
        """Both, facing to the front."""
        count, made = fineness.rim, list[Shape]()
        outline = self._outline(count) - self.middle
        rows = [outline * (k / fineness.lens) for k in range(fineness.lens, 0, -1)]
        flat = np.vstack([*rows, (0.0, 0.0)])
        dome = (
            _DOME
            * self.head.scale
            * (1.0 - np.repeat([k / fineness.lens for k in range(fineness.lens, -1, -1)], [count] * fineness.lens + [1]) ** 2)
        )
        k, after = np.arange(count), np.roll(np.arange(count), -1)
        tri = [np.column_stack([a + k, a + after, b + after]) for a, b in _rings(fineness.lens, count)]
        tri += [np.column_stack([a + k, b + after, b + k]) for a, b in _rings(fineness.lens, count)]
        inner = (fineness.lens - 1) * count
        tri.append(np.column_stack([inner + k, inner + after, np.full(count, fineness.lens * count)]))
        for sign in (1.0, -1.0):
            p = self._front(flat + self.middle)
            p[:, 2] += dome
            t = np.concatenate(tri).astype(np.int32)
            made.append((p * (sign, 1.0, 1.0), t if sign > 0.0 else t[:, ::-1]))
        return joined(made)

    def _rim(self, count: int) -> Shape:
        scale, style = self.head.scale, self.style
        flat = self._outline(count)
        out = flat - self.middle
        across = np.column_stack([out / np.array((self.half_lens, self.high)) ** 2, np.zeros(count)])
        if style.below:
            return bar(self._front(flat), across, style.wide * scale, style.deep * scale, closed=True)
        over = np.flatnonzero(out[:, 1] > -0.30 * self.high)
        order = over[np.argsort((np.arctan2(out[over, 1], out[over, 0]) + 0.5 * np.pi) % (2.0 * np.pi))]
        return bar(self._front(flat[order]), across[order], style.wide * scale, style.deep * scale)

    def _bridge(self, count: int) -> Shape:
        """From rim to rim, in an arch over the nose."""
        x = np.linspace(-1.0, 1.0, 2 * count + 1) * (self.gap + 0.0006 * self.head.scale)
        path = self._front(np.column_stack([x, self._bridge_at(x)]))
        scale = self.head.scale
        up = np.tile((0.0, 1.0, 0.0), (len(path), 1))
        return bar(path, up, 1.15 * self.style.wide * scale, 0.9 * self.style.deep * scale)

    def _temple(self, count: int, ear: Ear, sign: float) -> Shape:
        """From the rim out to the hinge, back to the top of the ear and down behind it; as if it were the left one."""
        scale, style = self.head.scale, self.style
        y = self.middle[1] + _HINGE * self.high
        outline = self._outline(360)
        side = outline[np.abs(outline[:, 1] - y).argsort()[:24]]
        rim = self._front(np.array([[side[:, 0].max(), y]]))[0]
        hinge_z = float(self._front(np.array([[rim[0] + _END_PIECE * scale, y]]))[0, 2]) - 0.006 * scale
        top = ear.top[0] + (0.0012 + style.temple) * scale, ear.top[1]
        back = np.array([(top[0] + down * scale, ear.back + behind * scale) for down, behind in _HOOK])
        # Straight to the ear, over its top, and down behind it.
        straight = np.linspace((y, hinge_z), top, count)
        over = np.vstack([straight, back])
        beside = self.head.aside(over, sign, _FLESH_M * scale) + (_OFF_TEMPLES + _THIN) * scale
        hinge_x = max(float(beside[0]), float(rim[0]) + _END_PIECE * scale)
        beside[0] = hinge_x
        x = np.append(_taut(-straight[:, 1], beside[:count]), beside[count:])
        corner = np.array((hinge_x - 0.0012 * scale, y, hinge_z + 0.0045 * scale))
        path = np.vstack([rim - (0.0008 * scale, 0.0, 0.0), corner, np.column_stack([x, over])])
        way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
        along: F64 = way / float(way[-1])
        thick = _THIN * np.interp(along, (0.0, 0.08, 0.6, 0.75, 1.0), (style.deep / _THIN, 1.3, 1.0, 1.1, 1.4))
        tall = style.temple * np.interp(along, (0.0, 0.12, 0.7, 1.0), (1.0, 1.0, 0.8, 0.9))
        return bar(path, carried(path, np.eye(3)[1]), tall * scale, thick * scale)


def _rings(lens: int, count: int) -> list[tuple[int, int]]:
    """Where rings of a lens begin, each with the next within it."""
    return [(k * count, (k + 1) * count) for k in range(lens - 1)]


def _taut(s: F64, x: F64) -> F64:
    """A thread over places x (N,) at s (N,), which rise, from the first to the last."""
    out = x.copy()
    hull = [0]
    for k in range(1, len(s)):
        while len(hull) > 1 and (x[hull[-1]] - x[hull[-2]]) * (s[k] - s[hull[-1]]) <= (x[k] - x[hull[-1]]) * (
            s[hull[-1]] - s[hull[-2]]
        ):
            hull.pop()
        hull.append(k)
    return np.maximum(out, np.interp(s, s[hull], x[hull]))

"""A head as hair knows it: where hair grows, how far inside the hairline a place is, and how far it is from the skin.

Directions on a head are azimuth (0 to the front, pi to the back, either side alike) and elevation, from the middle of the skull."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

from vistel.arrays import F64, I32
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.figure import vertex_normals
from vistel.figure.skeleton import JOINT_INDEX

_HAIRLINE = np.radians((
    (0.0, 38.5), (12.0, 38.8), (24.0, 37.8), (33.0, 34.5), (39.0, 30.5), (44.0, 24.5), (48.0, 17.0), (52.0, 8.0), (57.0, 1.0),
    (62.0, -7.0), (66.0, -17.0), (69.0, -27.0), (78.0, -28.0), (82.0, -13.0), (92.0, -9.0), (102.0, -12.0), (109.0, -22.0),
    (116.0, -33.0), (126.0, -41.0), (140.0, -46.0), (160.0, -48.0), (180.0, -47.0),
))  # fmt: skip
"""(K, 2) azimuth and elevation of the hairline: forehead, temple, before the ear, over it, behind it, nape."""
_TEMPLE = np.radians(30.0), np.radians(11.0)
"""Azimuth of the middle of the receding corner, and how far it reaches to either side."""
_BEFORE_EAR = np.radians(74.0), np.radians(12.0)
"""Azimuth of the middle of the hair before an ear, and how far it reaches to either side."""
_CLOSER = 0.8
"""How much closer places of the hairline are there: it is narrow."""
_NEAR = 4
"""Vertices of the body that decide how far a place is from its skin."""


@dataclass(frozen=True, eq=False)
class Roots:
    """Where strands grow. p, normal: (N, 3) [m, unit]; inside: (N,) distance from the hairline [m]; azimuth, elevation: (N,)
    [rad], azimuth negative on the right side."""

    p: F64
    normal: F64
    inside: F64
    azimuth: F64
    elevation: F64

    def __len__(self) -> int:
        return len(self.p)

    def of(self, rows: I32) -> "Roots":
        """Some of them."""
        return Roots(*(a[rows] for a in self._arrays))

    @staticmethod
    def together(several: "Sequence[Roots]") -> "Roots":
        """All of several."""
        return Roots(*(np.concatenate(a) for a in zip(*(r._arrays for r in several), strict=True)))

    @property
    def _arrays(self) -> tuple[F64, ...]:
        return self.p, self.normal, self.inside, self.azimuth, self.elevation


Density = Callable[["Scalp", Roots], F64]
"""(N,) how many roots there are at places, against others."""


class Scalp:
    """The head of an avatar of the body model in the T-pose. receding: how far the temples' hairline is drawn back, 0 to 1.

    middle: (3,) of the skull; eyes: (3,) between them; size: half the skull's length [m], 0.095 in adults; whorl: (3,) unit, from
    the middle to where hair turns."""

    def __init__(self, body: Avatar, receding: float = 0.0) -> None:
        self.body = body
        p, rest = body.mesh.vertices.astype(np.float64), body.skeleton.rest
        self.eyes = rest[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0)
        self.neck = rest[JOINT_INDEX["neck"]]
        top = float(p[:, 1].max())
        upper = p[(p[:, 1] > 0.7 * self.eyes[1] + 0.3 * top) & (np.abs(p[:, 0]) < 0.3 * (top - self.eyes[1])), 2]
        self.middle = np.array((0.0, 0.75 * self.eyes[1] + 0.25 * top, 0.5 * (upper.min() + upper.max())))
        self.size = 0.5 * float(upper.max() - upper.min())
        self.whorl = np.array((0.10, np.sin(np.radians(62.0)), -np.cos(np.radians(62.0))))
        self.whorl /= np.linalg.norm(self.whorl)
        azimuth, elevation = _HAIRLINE.T
        along = np.linspace(0.0, np.pi, 361)
        middle, reach = _TEMPLE
        drawn_back: F64 = receding * np.radians(16.0) * np.exp(-np.square((along - middle) / reach))
        self._line: tuple[F64, F64] = (
            along,
            np.interp(along, azimuth, elevation) + drawn_back + receding * np.radians(5.0) * (along < 0.8),
        )
        self._on_line: Any = KDTree(_unit(*self._line))

    @cached_property
    def normals(self) -> F64:
        """(V, 3) of the body's vertices."""
        return vertex_normals(self.body.mesh).astype(np.float64)

    @cached_property
    def _skin(self) -> tuple[Any, F64, F64, I32]:
        """Of the head and what hair may lie on: a tree of the vertices, these, their normals, and which they are."""
        p = self.body.mesh.vertices.astype(np.float64)
        near = np.flatnonzero((np.abs(p[:, 0]) < 3.2 * self.size) & (p[:, 1] > self.neck[1] - 5.0 * self.size))
        return KDTree(p[near]), p[near], self.normals[near], near.astype(np.int32)

    @cached_property
    def _far(self) -> F64:
        return self.within(self.body.mesh)

    def within(self, mesh: Mesh) -> F64:
        """(V,) how far vertices of a level of the body are inside the hairline [m]; far outside where there is no head."""
        p = mesh.vertices.astype(np.float64)
        head = p[:, 1] > self.middle[1] - 1.4 * self.size
        out = np.full(len(p), -self.size)
        out[head] = self.inside(p[head])
        return out

    def hairline(self, count: int) -> tuple[F64, F64]:
        """(N,) azimuths from -pi on and elevations of places all round the hairline, closest before the ears [rad]."""
        one, high = self._line
        azimuth, elevation = np.concatenate([-one[:0:-1], one]), np.concatenate([high[:0:-1], high])
        step = np.linalg.norm(np.diff(_unit(azimuth, elevation), axis=0), axis=1)
        step *= 1.0 + _CLOSER * (np.abs(np.abs(azimuth[1:]) - _BEFORE_EAR[0]) < _BEFORE_EAR[1])
        way = np.append(0.0, np.cumsum(step))
        at: F64 = np.linspace(0.0, float(way[-1]), count, endpoint=False)
        return np.interp(at, way, azimuth), np.interp(at, way, elevation)

    def traced(self, d: F64) -> tuple[F64, F64]:
        """(N, 3) places of the skin in directions (N, 3) from the middle of the skull [m], and (N, 3) unit the way out there."""
        far = np.full(len(d), 0.6 * self.size)
        for _ in range(14):
            away, _ = self.skin(self.middle + far[:, None] * d)
            far = np.clip(far - 0.9 * away, 0.5 * self.size, 1.5 * self.size)
        p = self.middle + far[:, None] * d
        return p, self.skin(p)[1]

    def nearest(self, p: F64) -> I32:
        """(N, 4) the body's vertices nearest to places (N, 3)."""
        tree, _, _, number = self._skin
        return number[np.asarray(tree.query(p, k=_NEAR)[1])]

    def angles(self, p: F64) -> tuple[F64, F64]:
        """Azimuth, negative on the right side, and elevation of places (N, 3) [rad]."""
        d = p - self.middle
        return np.arctan2(d[:, 0], d[:, 2]), np.arctan2(d[:, 1], np.hypot(d[:, 0], d[:, 2]))

    def inside(self, p: F64) -> F64:
        """(N,) how far places (N, 3) of the head are inside the hairline, along the skull [m]; negative: outside."""
        azimuth, elevation = self.angles(p)
        azimuth = np.abs(azimuth)
        away = np.asarray(self._on_line.query(_unit(azimuth, elevation))[0])
        return self.size * away * np.where(elevation > np.interp(azimuth, *self._line), 1.0, -1.0)

    def skin(self, p: F64, near: int = _NEAR) -> tuple[F64, F64]:
        """(N,) distance of places (N, 3) from the skin [m], negative inside, and (N, 3) unit the way out, by that many of the
        nearest vertices: several for a smooth way, one where skin is thin, as ears are."""
        tree, skin, normal, _ = self._skin
        far, which = (np.asarray(a).reshape(len(p), near) for a in tree.query(p, k=near))
        share = 1.0 / np.maximum(far, 1e-4) ** 2
        share /= share.sum(axis=1, keepdims=True)
        away = np.einsum("nk,nki,nki->n", share, p[:, None] - skin[which], normal[which])
        out = np.einsum("nk,nki->ni", share, normal[which])
        return away, out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)

    def roots(
        self, count: int, rng: np.random.Generator, least: float = 0.0, most: float = np.inf, dense: Density | None = None
    ) -> Roots:
        """`count` places of the skin inside the hairline by `least` to `most` [m], spread evenly or as `dense` has it: each is far
        from those before it, so that the first of them are spread as well."""
        mesh, at = self.body.mesh, self.body.mesh.vertices.astype(np.float64)
        tri = mesh.triangles
        far = self._far[tri]
        hairy = (far > least - 0.01 * self.size).any(axis=1) & (far < most + 0.01 * self.size).any(axis=1)
        tri = tri[hairy]
        corner = at[tri]
        area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
        many = 12 * count + 200
        of = rng.choice(len(tri), many, p=area / area.sum())
        share = rng.dirichlet((1.0, 1.0, 1.0), many)
        p = np.einsum("nk,nki->ni", share, corner[of])
        normal = np.einsum("nk,nki->ni", share, self.normals[tri[of]])
        inside = self.inside(p)
        # Not on the ears: skin there faces along the skull, not away from it.
        d = p - self.middle
        out = np.einsum("ni,ni->n", d, normal) > 0.6 * np.linalg.norm(d, axis=1)
        fit = np.flatnonzero((inside > least) & (inside < most) & out)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        every = Roots(p, normal, inside, *self.angles(p)).of(fit.astype(np.int32))
        return every.of(_spread(every.p, count, np.ones(len(every)) if dense is None else dense(self, every)))


def _unit(azimuth: F64, elevation: F64) -> F64:
    c = np.cos(elevation)
    return np.stack([np.sin(azimuth) * c, np.sin(elevation), np.cos(azimuth) * c], axis=-1)


def _spread(p: F64, count: int, dense: F64) -> I32:
    """(count,) rows of p (N, 3), each the farthest from those chosen before it, as seen where they are `dense` (N,)."""
    out = np.zeros(min(count, len(p)), np.int32)
    far = np.full(len(p), np.inf)
    for k in range(1, len(out)):
        far = np.minimum(far, ((p - p[out[k - 1]]) ** 2).sum(axis=1) * dense)
        out[k] = int(far.argmax())
    return out

"""Tracks marks from frame to frame: a Kalman filter over all marks, and one assignment of spots.

The filter's covariance is that of `MarkShape`, so hidden marks follow those that are seen. Where exchanging two marks would be
nearly as likely, both are predicted until the others decide.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, Bool
from vistel.figure.face.marks import MARK_COUNT
from vistel.vision.assignment import assign
from vistel.vision.mark_ambiguity import GATE, NOISE_M, ambiguity_of, condition
from vistel.vision.mark_shape import MarkShape, standard_shape

_RELAX_S = 0.8
"""Time constant with which the filter returns the face to rest [s]."""
_AMBIGUOUS_S = 0.6
"""After this time of ambiguity all marks are searched again [s]."""
_UNCERTAIN_M = 0.006
"""Standard deviation of a mark measured by a spot that may not be its own [m]."""
_TOUCH_M = 0.0075
"""Marks that are nearer to each other merge [m]."""
_FITS = 6.0
"""Squared Mahalanobis distance within which a mark fits the face. It is narrow: after one mark has passed over another, both
assignments may look like an expression."""
_ACCEPTED_S = 0.08
"""A lost mark is accepted again after it has fitted the face for this time [s]."""
_SPEED_KEPT_S = 0.1
"""Time constant with which the speed of a hidden mark decays [s]."""
_LOST_S = 0.7
"""With fewer than `_ENOUGH` marks seen for this time all marks are searched again [s]."""
_ENOUGH = 6
"""Marks that must be seen."""


@dataclass(frozen=True)
class TrackedMarks:
    """position: (13, 2) metres, head frame with the helmet's slip. seen: (13,) False where it is predicted from the others.
    spot: (13,) index of each mark's spot, -1 for none. found: whether a face is."""

    position: F64
    seen: Bool
    spot: NDArray[np.int64]
    found: bool


class MarkTracker:
    """Assigns the spots of each frame [m, head frame] to marks."""

    def __init__(self, shape: MarkShape | None = None) -> None:
        self._shape = shape or standard_shape()
        self._prior = self._shape.covariance
        self._mean = self._shape.rest.copy()
        self._cov = self._prior.copy()
        self._speed = np.zeros(2 * MARK_COUNT)
        self._found = False
        self._poor_s = self._ambiguous_s = 0.0
        self._merged = np.zeros((MARK_COUNT, MARK_COUNT), bool)
        self._seen = np.zeros(MARK_COUNT, bool)
        self._fits_s = np.zeros(MARK_COUNT)

    def expected(self, dt_s: float) -> F64:
        """(13, 2) predicted positions of the marks `dt_s` after the last frame [m]."""
        return self._predict(dt_s)[0].reshape(-1, 2)

    def forget(self) -> None:
        """Forget the face and search all marks again."""
        self._mean, self._cov = self._shape.rest.copy(), self._prior.copy()
        self._speed[:] = 0.0
        self._found, self._poor_s, self._ambiguous_s = False, 0.0, 0.0
        self._merged[:] = False

    def step(self, spots: F64, dt_s: float, single: Bool | None = None) -> TrackedMarks:
        """spots: (n, 2) metres. dt_s: since the last step. single: (n,) False for a spot that may be several merged marks."""
        mean, cov = self._predict(dt_s)
        spot = self._assign(spots, mean, cov)
        if not self._found:
            spot = self._refine(spots, spot, mean, cov)
        now = ambiguity_of(spots, spot, mean, cov)
        shape = ambiguity_of(spots, spot, self._shape.rest, self._prior)
        own = spot >= 0
        if single is not None:
            own[own] = single[spot[own]]
        self._fits_s = np.where(own & ~shape.ambiguous & (shape.far < _FITS), self._fits_s + dt_s, 0.0)
        fits = self._fits_s >= _ACCEPTED_S
        self._update_merged(spots, spot, mean, fits)
        seen = own & ~now.ambiguous & ~shape.swapped & ~self._merged.any(1)
        if not self._found:
            seen &= shape.far < _FITS
            self._found = int(seen.sum()) >= MARK_COUNT - 2
            if not self._found:
                return TrackedMarks(mean.reshape(-1, 2), np.zeros(MARK_COUNT, bool), spot, False)
        else:
            # A lost mark is accepted again where it fits the face, not where it was predicted.
            seen &= self._seen | fits
        self._seen = seen
        self._update(spots, spot, seen, mean, cov, dt_s)
        self._poor_s = 0.0 if seen.sum() >= _ENOUGH else self._poor_s + dt_s
        # Spots for all marks, but some marks ambiguous: one wrong assignment may block the others.
        stuck = not seen.all() and len(spots) >= MARK_COUNT
        self._ambiguous_s = self._ambiguous_s + dt_s if shape.swapped.any() or stuck else 0.0
        position, found = self._mean.reshape(-1, 2).copy(), self._found
        if self._poor_s > _LOST_S or self._ambiguous_s > _AMBIGUOUS_S:
            self.forget()
        return TrackedMarks(position, seen, np.where(seen, spot, -1), found)

    def _predict(self, dt_s: float) -> tuple[F64, F64]:
        if not self._found:
            return self._shape.rest, self._prior
        keep = math.exp(-dt_s / _RELAX_S)
        rest = self._shape.rest
        mean = rest + keep * (self._mean - rest) + self._speed * dt_s
        return mean, keep**2 * self._cov + (1.0 - keep**2) * self._prior

    def _assign(self, spots: F64, mean: F64, cov: F64) -> NDArray[np.int64]:
        """(13,) the spot of each mark, -1 for none, by linear assignment; a mark without spot costs the gate."""
        if not len(spots):
            return np.full(MARK_COUNT, -1, np.int64)
        d = spots[None] - mean.reshape(-1, 1, 2)
        blocks = np.stack([cov[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in range(MARK_COUNT)])
        inverse = np.linalg.inv(blocks + NOISE_M**2 * np.eye(2))
        cost = np.minimum(np.einsum("ijk,ikl,ijl->ij", d, inverse, d), 10.0 * GATE)
        # One spare column per mark, so that any number of marks may be without a spot.
        columns = assign(np.hstack((cost, np.full((MARK_COUNT, MARK_COUNT), GATE))))
        return np.where(columns < len(spots), columns, -1)

    def _refine(self, spots: F64, spot: NDArray[np.int64], mean: F64, cov: F64) -> NDArray[np.int64]:
        """Repeat the first assignment until it is stable: the assigned marks predict the others."""
        for _ in range(6):
            at = np.flatnonzero(spot >= 0)
            if len(at) < 4:
                return spot
            better = np.full(MARK_COUNT, -1, np.int64)
            m, p = condition(mean, cov, at, spots[spot[at]], 4.0 * NOISE_M)
            better = self._assign(spots, m, p + (2.0 * NOISE_M) ** 2 * np.eye(len(p)))
            if np.array_equal(better, spot):
                return spot
            spot = better
        return spot

    def _update_merged(self, spots: F64, spot: NDArray[np.int64], mean: F64, fits: Bool) -> None:
        """Marks that touch count as merged until both are seen apart and fit the face."""
        at = mean.reshape(-1, 2).copy()
        at[spot >= 0] = spots[spot[spot >= 0]]
        apart = np.hypot(*(at[:, None] - at[None]).transpose(2, 0, 1)) + np.where(np.eye(MARK_COUNT) > 0, np.inf, 0.0)
        certain = fits & (spot >= 0)
        self._merged = (apart < _TOUCH_M) | (self._merged & ~(certain[:, None] & certain[None]))

    def _update(self, spots: F64, spot: NDArray[np.int64], seen: Bool, mean: F64, cov: F64, dt_s: float) -> None:
        before = self._mean
        for these, noise in ((seen, NOISE_M), ((spot >= 0) & ~seen, _UNCERTAIN_M)):
            at = np.flatnonzero(these)
            mean, cov = condition(mean, cov, at, spots[spot[at]], noise)
        self._mean, self._cov = mean, cov
        if dt_s > 0.0:
            new = 0.5 * self._speed + 0.5 * (self._mean - before) / dt_s
            self._speed = np.where(np.repeat(seen, 2), new, self._speed * math.exp(-dt_s / _SPEED_KEPT_S))

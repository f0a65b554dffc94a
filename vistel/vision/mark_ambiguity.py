"""How ambiguous an assignment of spots to marks is, under a joint Gaussian of all marks."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, I64, Bool
from vistel.figure.face.marks import MARK_COUNT

NOISE_M = 0.0004
"""Standard deviation of a centre, with a mark's own movement between two frames [m]."""
GATE = 25.0
"""Squared Mahalanobis distance beyond which a spot is not a mark."""
_MARGIN = 14.0
"""By how much more another assignment must cost for a mark to be unambiguous (twice the log likelihood ratio)."""
_SWAPPED = 8.0
"""By how much cheaper the exchange of two marks must be for them to count as swapped."""
_MARK_M = 0.003
"""Radius of a mark: a hidden one may be under another's spot [m]."""


@dataclass(frozen=True)
class Ambiguity:
    """For each mark (13,). ambiguous: another assignment of it is nearly as likely. swapped: exchanged with another mark it
    would make a likelier face. far: squared Mahalanobis distance from the position that the others predict; infinite for
    a mark without a spot."""

    ambiguous: Bool
    swapped: Bool
    far: F64


def ambiguity_of(spots: F64, spot: I64, mean: F64, cov: F64) -> Ambiguity:
    """spots: (n, 2) [m]; spot: (13,) index of each mark's spot, -1 for none; mean (26,), cov (26, 26): of the marks."""
    ambiguous, swapped, far = spot < 0, np.zeros(MARK_COUNT, bool), np.full(MARK_COUNT, np.inf)
    at = np.flatnonzero(spot >= 0)
    if len(at) < 2:
        return Ambiguity(np.ones(MARK_COUNT, bool), swapped, far)
    where = spots[spot[at]]
    weighted, block = _residual(where, at, mean, cov)
    own = block[np.arange(len(at)), :, np.arange(len(at))]
    far[at] = np.einsum("nk,nk->n", weighted, np.linalg.solve(own, weighted[..., None])[..., 0])
    change = _exchanged(where, weighted, block)
    ambiguous[at] |= change.min(1) < _MARGIN
    swapped[at] = change.min(1) < -_SWAPPED
    spare = np.setdiff1d(np.arange(len(spots)), spot[at])
    if len(spare):
        e = spots[spare][None] - where[:, None]
        change = 2.0 * np.einsum("nmk,nk->nm", e, weighted) + np.einsum("nmk,nkl,nml->nm", e, own, e)
        ambiguous[at] |= (change < _MARGIN).any(1)
    for hidden in np.flatnonzero(spot < 0):
        ambiguous[at] |= _ambiguous_with(int(hidden), where, at, mean, cov, far[at])
    return Ambiguity(ambiguous, swapped, far)


def condition(mean: F64, cov: F64, at: I64, where: F64, noise: float) -> tuple[F64, F64]:
    """Mean and covariance of all marks, given marks `at` measured at `where` (k, 2) with deviation `noise` [m]."""
    if not len(at):
        return mean, cov
    index = np.column_stack((2 * at, 2 * at + 1)).ravel()
    rows = cov[index]
    s = rows[:, index] + noise**2 * np.eye(len(index))
    gain = np.linalg.solve(s, rows).T
    new = cov - gain @ rows
    return mean + gain @ (where.ravel() - mean[index]), 0.5 * (new + new.T)


def _ambiguous_with(hidden: int, where: F64, at: I64, mean: F64, cov: F64, far: F64) -> Bool:
    """(k,) whether the spot of each mark `at` could be that of the mark `hidden`, which has none."""
    out = np.zeros(len(at), bool)
    its = slice(2 * hidden, 2 * hidden + 2)
    uncertain = _MARK_M**2 * np.eye(2)
    for k in range(len(at)):
        if _far(where[k] - mean[its], cov[its, its] + uncertain) > GATE:
            continue
        rest = np.delete(np.arange(len(at)), k)
        m, p = condition(mean, cov, at[rest], where[rest], NOISE_M)
        out[k] = _far(where[k] - m[its], p[its, its] + uncertain) - far[k] < _MARGIN
    return out


def _far(d: F64, spread: F64) -> float:
    """dᵀ spread⁻¹ d."""
    return float(d @ np.linalg.solve(spread, d))


def _residual(where: F64, at: I64, mean: F64, cov: F64) -> tuple[F64, F64]:
    """S⁻¹ d (k, 2) and S⁻¹ (k, 2, k, 2) for marks `at` measured at `where` (k, 2)."""
    index = np.column_stack((2 * at, 2 * at + 1)).ravel()
    inverse = np.asarray(np.linalg.inv(cov[np.ix_(index, index)] + NOISE_M**2 * np.eye(len(index))), np.float64)
    weighted = inverse @ (where - mean.reshape(-1, 2)[at]).ravel()
    return weighted.reshape(-1, 2), inverse.reshape(len(at), 2, len(at), 2)


def _exchanged(where: F64, weighted: F64, block: F64) -> F64:
    """(k, k) growth of dᵀ S⁻¹ d when the measurements of two marks are exchanged; infinite on the diagonal."""
    out = np.full((len(where), len(where)), np.inf)
    i, j = np.triu_indices(len(where), 1)
    e = where[j] - where[i]
    curve = block[i, :, i] + block[j, :, j] - block[i, :, j] - block[j, :, i]
    out[i, j] = 2.0 * np.einsum("nk,nk->n", e, weighted[i] - weighted[j]) + np.einsum("nk,nkl,nl->n", e, curve, e)
    out[j, i] = out[i, j]
    return out

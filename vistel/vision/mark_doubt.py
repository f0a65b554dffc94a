"""How sure an assignment of spots to marks is, under a Gaussian of where all marks are together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, I64, Bool
from vistel.figure.face.marks import MARK_COUNT

NOISE_M = 0.0004
"""Of a centre, with what a mark does between two frames on its own."""
GATE = 25.0
"""Squared Mahalanobis distance beyond which a spot is not a mark."""
_MARGIN = 14.0
"""By how much more another assignment must cost for a mark to be certain (log likelihood ratio, doubled)."""
_ODD = 8.0
"""By how much cheaper the exchange of two marks must be for them to be odd."""
_MARK_M = 0.003
"""A mark's radius: a hidden one may be under another's spot."""


@dataclass(frozen=True)
class Judgement:
    """Of each mark (13,). doubtful: its spot might as well be another mark's, or another spot its own. odd: exchanged with
    another it would make a likelier face. far: squared Mahalanobis distance from where the others expect it; infinite for a
    mark without a spot."""

    doubtful: Bool
    odd: Bool
    far: F64


def judge(spots: F64, spot: I64, mean: F64, cov: F64) -> Judgement:
    """spots: (n, 2) [m]; spot: (13,) index of each mark's, -1 for none; mean (26,), cov (26, 26): of the marks."""
    doubtful, odd, far = spot < 0, np.zeros(MARK_COUNT, bool), np.full(MARK_COUNT, np.inf)
    at = np.flatnonzero(spot >= 0)
    if len(at) < 2:
        return Judgement(np.ones(MARK_COUNT, bool), odd, far)
    where = spots[spot[at]]
    pull, block = _residual(where, at, mean, cov)
    own = block[np.arange(len(at)), :, np.arange(len(at))]
    far[at] = np.einsum("nk,nk->n", pull, np.linalg.solve(own, pull[..., None])[..., 0])
    change = _exchanged(where, pull, block)
    doubtful[at] |= change.min(1) < _MARGIN
    odd[at] = change.min(1) < -_ODD
    spare = np.setdiff1d(np.arange(len(spots)), spot[at])
    if len(spare):
        e = spots[spare][None] - where[:, None]
        change = 2.0 * np.einsum("nmk,nk->nm", e, pull) + np.einsum("nmk,nkl,nml->nm", e, own, e)
        doubtful[at] |= (change < _MARGIN).any(1)
    for hidden in np.flatnonzero(spot < 0):
        doubtful[at] |= _rivalled(int(hidden), where, at, mean, cov, far[at])
    return Judgement(doubtful, odd, far)


def condition(mean: F64, cov: F64, at: I64, where: F64, noise: float) -> tuple[F64, F64]:
    """Mean and covariance of all marks, given that marks `at` were measured at `where` (k, 2)."""
    if not len(at):
        return mean, cov
    index = np.column_stack((2 * at, 2 * at + 1)).ravel()
    rows = cov[index]
    s = rows[:, index] + noise**2 * np.eye(len(index))
    gain = np.linalg.solve(s, rows).T
    new = cov - gain @ rows
    return mean + gain @ (where.ravel() - mean[index]), 0.5 * (new + new.T)


def _rivalled(hidden: int, where: F64, at: I64, mean: F64, cov: F64, far: F64) -> Bool:
    """(k,) which of the marks `at` might be this one that has no spot: the others would let it lie there nearly as well."""
    out = np.zeros(len(at), bool)
    its = slice(2 * hidden, 2 * hidden + 2)
    vague = _MARK_M**2 * np.eye(2)
    for k in range(len(at)):
        if _far(where[k] - mean[its], cov[its, its] + vague) > GATE:
            continue
        rest = np.delete(np.arange(len(at)), k)
        m, p = condition(mean, cov, at[rest], where[rest], NOISE_M)
        out[k] = _far(where[k] - m[its], p[its, its] + vague) - far[k] < _MARGIN
    return out


def _far(d: F64, spread: F64) -> float:
    """dᵀ spread⁻¹ d."""
    return float(d @ np.linalg.solve(spread, d))


def _residual(where: F64, at: I64, mean: F64, cov: F64) -> tuple[F64, F64]:
    """Of marks `at` measured at `where` (k, 2): S⁻¹ d (k, 2) and S⁻¹ (k, 2, k, 2)."""
    index = np.column_stack((2 * at, 2 * at + 1)).ravel()
    inverse = np.asarray(np.linalg.inv(cov[np.ix_(index, index)] + NOISE_M**2 * np.eye(len(index))), np.float64)
    pull = inverse @ (where - mean.reshape(-1, 2)[at]).ravel()
    return pull.reshape(-1, 2), inverse.reshape(len(at), 2, len(at), 2)


def _exchanged(where: F64, pull: F64, block: F64) -> F64:
    """(k, k): by how much dᵀ S⁻¹ d grows when two marks' measurements are exchanged; infinite on the diagonal."""
    out = np.full((len(where), len(where)), np.inf)
    i, j = np.triu_indices(len(where), 1)
    e = where[j] - where[i]
    curve = block[i, :, i] + block[j, :, j] - block[i, :, j] - block[j, :, i]
    out[i, j] = 2.0 * np.einsum("nk,nk->n", e, pull[i] - pull[j]) + np.einsum("nk,nkl,nl->n", e, curve, e)
    out[j, i] = out[i, j]
    return out

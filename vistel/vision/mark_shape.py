"""How the marks of a face can lie: a Gaussian of where they are together, from the expressions and from a helmet that slips."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.face.marks import MARK_COUNT, MOVES, REST

_EXPRESSION = 0.35
"""Standard deviation of an expression's value."""
_OWN_M = 0.0015
"""Standard deviation of a mark's place from that of the table of expressions [m]."""
_SLIP_M = 0.006
"""Standard deviation of the helmet's shift on the head [m]."""
_SLIP_RAD = 0.05
"""Standard deviation of the helmet's turn on the head [rad]."""
_SLIP_SCALE = 0.03
"""Standard deviation of the picture's scale, as the camera comes nearer or moves away (share)."""


@dataclass(frozen=True)
class MarkShape:
    """In metres of the head's frame, flattened (x, y) of `MARKS`: rest (26,); expression (26, 26) covariance of what the
    face does; slip (26, 4): how the marks move with a slip of the helmet by one metre in x, in y, by one radian and by
    twice the size; slip_deviation (4,)."""

    rest: F64
    expression: F64
    slip: F64
    slip_deviation: F64

    @property
    def covariance(self) -> F64:
        """(26, 26) of the marks as the camera sees them."""
        moved = self.slip * self.slip_deviation
        return self.expression + moved @ moved.T

    def slip_of(self, marks: F64, known: NDArray[np.bool_]) -> F64:
        """(4,) most likely slip behind marks (13, 2), of which those `known` (13,) were seen."""
        at = np.repeat(known, 2)
        if not at.any():
            return np.zeros(4)
        j = self.slip[at]
        weighted = np.linalg.solve(self.expression[np.ix_(at, at)], j)
        prior = np.diag(self.slip_deviation**-2)
        return np.asarray(np.linalg.solve(j.T @ weighted + prior, weighted.T @ (marks.ravel() - self.rest)[at]), np.float64)


@cache
def standard_shape() -> MarkShape:
    """Of the 13 marks and ARKit's expressions."""
    rest = REST.ravel()
    basis = np.array([move.ravel() for move in MOVES.values()])
    # Expressions are 0..1, not about 0: their mean moves the middle, which neutral-face calibration puts back to rest.
    expression = _EXPRESSION**2 * basis.T @ basis + _OWN_M**2 * np.eye(2 * MARK_COUNT)
    centred = REST - REST.mean(0)
    slip = np.zeros((MARK_COUNT, 2, 4))
    slip[:, 0, 0] = slip[:, 1, 1] = 1.0
    slip[:, :, 2] = np.column_stack((-centred[:, 1], centred[:, 0]))
    slip[:, :, 3] = centred
    deviation = np.array((_SLIP_M, _SLIP_M, _SLIP_RAD, _SLIP_SCALE))
    return MarkShape(rest, expression, slip.reshape(-1, 4), deviation)

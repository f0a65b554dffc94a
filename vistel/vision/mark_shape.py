"""A joint Gaussian of the marks of a face: covariance of expressions, and of a helmet that slips."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.face.marks import MARK_COUNT, MOVES, REST

_EXPRESSION = 0.35
"""Standard deviation of an expression's value."""
_OWN_M = 0.0015
"""Standard deviation of a mark from the table of expressions [m]."""
_SLIP_M = 0.006
"""Standard deviation of the helmet's shift on the head [m]."""
_SLIP_RAD = 0.05
"""Standard deviation of the helmet's turn on the head [rad]."""
_SLIP_SCALE = 0.03
"""Standard deviation of the picture's scale, as the distance of the camera changes (share)."""


@dataclass(frozen=True)
class MarkShape:
    """In metres, head frame, flattened (x, y) of `MARKS`: rest (26,); expression (26, 26) covariance of expressions; slip
    (26, 4): derivatives of the marks by the helmet's shift in x and y [m], turn [rad] and scale; slip_deviation (4,)."""

    rest: F64
    expression: F64
    slip: F64
    slip_deviation: F64

    @property
    def covariance(self) -> F64:
        """(26, 26) of the marks in the camera's picture."""
        moved = self.slip * self.slip_deviation
        return self.expression + moved @ moved.T

    def slip_of(self, marks: F64, known: NDArray[np.bool_]) -> F64:
        """(4,) most likely slip for marks (13, 2), of which those `known` (13,) were seen."""
        at = np.repeat(known, 2)
        if not at.any():
            return np.zeros(4)
        j = self.slip[at]
        weighted = np.linalg.solve(self.expression[np.ix_(at, at)], j)
        prior = np.diag(self.slip_deviation**-2)
        return np.asarray(np.linalg.solve(j.T @ weighted + prior, weighted.T @ (marks.ravel() - self.rest)[at]), np.float64)


@cache
def standard_shape() -> MarkShape:
    """The shape of the standard face with ARKit's expressions."""
    rest = REST.ravel()
    basis = np.array([move.ravel() for move in MOVES.values()])
    # Expressions are 0..1, not about 0; calibration of the neutral face removes their mean.
    expression = _EXPRESSION**2 * basis.T @ basis + _OWN_M**2 * np.eye(2 * MARK_COUNT)
    centred = REST - REST.mean(0)
    slip = np.zeros((MARK_COUNT, 2, 4))
    slip[:, 0, 0] = slip[:, 1, 1] = 1.0
    slip[:, :, 2] = np.column_stack((-centred[:, 1], centred[:, 0]))
    slip[:, :, 3] = centred
    deviation = np.array((_SLIP_M, _SLIP_M, _SLIP_RAD, _SLIP_SCALE))
    return MarkShape(rest, expression, slip.reshape(-1, 4), deviation)

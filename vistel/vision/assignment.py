"""Linear assignment."""

from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

from vistel.arrays import F64


def assign(cost: F64) -> NDArray[np.int64]:
    """(rows,) the column of each row of `cost` (rows, columns >= rows), no column twice, of least total cost."""
    return np.asarray(cast("tuple[NDArray[np.intp], NDArray[np.intp]]", linear_sum_assignment(cost))[1], np.int64)

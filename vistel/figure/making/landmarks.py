"""Joints of a person whose mesh has no rig, found from its shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.figure.making.source import MakingError

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]


def joints_by_shape(points: F64, triangles: I32) -> dict[str, F64]:
    raise MakingError("no rig")

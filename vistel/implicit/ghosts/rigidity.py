"""How much each of two bodies gives way: Singh's relative rigidity w, and compliances (Singh §C.1; mathematics M3.8).

w in [0, 1] is the rigidity of i against j: 0 where j is rigid, 1/2 where both give way alike, 1 where i is rigid.
Compliances c say the same for any number of bodies, 2w = c_j / c_i; everywhere else in VISTEL bodies have compliances.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64
from vistel.implicit.constants import THRESHOLD


def ghosts_in_contact(field_i: ArrayLike, field_j: ArrayLike, w: float, threshold: float = THRESHOLD) -> tuple[F64, F64]:
    """(G_i onto j, G_j onto i) where the two overlap, for a rigidity w; they meet where y_j = 2 w y_i (w <= 1/2)."""
    y_i, y_j = threshold - np.asarray(field_i, np.float64), threshold - np.asarray(field_j, np.float64)
    if w > 0.5:
        onto_i, onto_j = ghosts_in_contact(field_j, field_i, 1.0 - w, threshold)
        return onto_j, onto_i
    return 2 * w * y_i, y_j + (1 - 2 * w) * y_i


def compliances(w: float) -> tuple[float, float]:
    """(c_i, c_j) of a rigidity w, the softer of the two 1."""
    return (1.0, 2.0 * w) if w <= 0.5 else (2.0 * (1.0 - w), 1.0)


def rigidity(c_i: float, c_j: float) -> float:
    """w of two compliances; 1/2 where both are rigid."""
    if c_i == c_j:
        return 0.5
    return 0.5 * c_j / c_i if c_j < c_i else 1.0 - 0.5 * c_i / c_j


def normals_cosine(radius_i: float, radius_j: float, depth: float) -> float:
    """N_i . N_j where the surfaces of two balls cross that overlap by `depth` [m] (Figure 71, corrected: mathematics M3.9)."""
    d = radius_i + radius_j - depth
    return (radius_i**2 + radius_j**2 - d * d) / (2 * radius_i * radius_j)

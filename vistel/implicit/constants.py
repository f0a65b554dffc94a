"""Numbers that NumPy code, Numba kernels and shaders share. Fields have no unit; mathematics M3 uses T, alpha and beta."""

import math

THRESHOLD = 0.5
"""The level T of the surface F = T used everywhere unless another is given."""
SURFACE_RATIO = math.sqrt(1.0 - math.sqrt(THRESHOLD))
"""Distance ratio at which the quartic blend has the value T: surface radius / radius of the realm."""
ALPHA = 0.6
"""Share of T that all propagations into a body together may reach (mathematics M3.6)."""
BETA = 3.0
"""Zone of propagation / penetration (mathematics M3.4)."""
LONGEST_ZONE = 27.0 / 4.0 * ALPHA * THRESHOLD
"""Zone of one propagation that rises to alpha T, in units of the body's compliance (mathematics M3.6)."""
GHOST_CAP = 0.98
"""Share of T below which all that raises a skin stays together, so that no ghost raises a surface of its own."""
MOST_CHANGE = 0.9
"""Force fields change a body's own field by at most this share, so that its surface stays in one piece."""
LEAST_DIVISOR = 1e-6
"""Least zone [field] and least distance ratio on a constraint's plateau, against divisions by zero."""
LEAST_SQUARE = 1.2e-38
"""Squared lengths of float32 vectors up to this have no direction: GPUs take smaller numbers for 0."""

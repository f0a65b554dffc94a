"""Float32 numbers for kernels: beside a plain 2.0, which is float64, everything would become float64."""

import numpy as np

ZERO = np.float32(0.0)
QUARTER = np.float32(0.25)
HALF = np.float32(0.5)
ONE = np.float32(1.0)
TWO = np.float32(2.0)
THREE = np.float32(3.0)
FOUR = np.float32(4.0)
EIGHT = np.float32(8.0)

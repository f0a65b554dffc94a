"""Vectors of three numbers in kernels, as tuples: unlike arrays they cost no memory, and little to compile."""

from vistel.arrays import F64
from vistel.jit.kernel_jit import inner

Triple = tuple[float, float, float]


@inner
def difference(a: Triple | F64, b: Triple | F64) -> Triple:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inner
def cross(a: Triple | F64, b: Triple | F64) -> Triple:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inner
def dot(a: Triple | F64, b: Triple | F64) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

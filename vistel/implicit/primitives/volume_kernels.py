"""The kernels of the analytic kinds of primitives by their code; these kinds may be the volumes of pointblobs."""

# pyright: basic

from vistel.implicit.primitives.kinds import KIND_INDEX
from vistel.implicit.primitives.primitive_kernels import (
    cone_sphere,
    rounded_polygon,
    sphere,
    sphylinder,
    superellipsoid,
    supertoroid,
)
from vistel.implicit.rows.row_kernels import row

_SPHERE = KIND_INDEX["sphere"]
_SPHYLINDER = KIND_INDEX["sphylinder"]
_CONE_SPHERE = KIND_INDEX["cone_sphere"]
_ROUNDED_POLYGON = KIND_INDEX["rounded_polygon"]
_SUPERELLIPSOID = KIND_INDEX["superellipsoid"]
_SUPERTOROID = KIND_INDEX["supertoroid"]


@row
def volume(kind, p, x, y, z, u, gx, gy, gz, n, slope):
    """d^2 and, where `slope`, its gradient of one primitive with the parameters p at n points."""
    if kind == _SPHERE:
        sphere(p, x, y, z, u, gx, gy, gz, n, slope)
    elif kind == _SPHYLINDER:
        sphylinder(p, x, y, z, u, gx, gy, gz, n, slope)
    elif kind == _CONE_SPHERE:
        cone_sphere(p, x, y, z, u, gx, gy, gz, n, slope)
    elif kind == _ROUNDED_POLYGON:
        rounded_polygon(p, x, y, z, u, gx, gy, gz, n, slope)
    elif kind == _SUPERELLIPSOID:
        superellipsoid(p, x, y, z, u, gx, gy, gz, n, slope)
    elif kind == _SUPERTOROID:
        supertoroid(p, x, y, z, u, gx, gy, gz, n, slope)

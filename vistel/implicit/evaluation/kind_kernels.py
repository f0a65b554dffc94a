"""The kernel of every kind of primitive by its code."""

# pyright: basic

from vistel.implicit.graph.ghost_kernels import ramp
from vistel.implicit.primitives.blob_kernels import point_setblob, pointblob
from vistel.implicit.primitives.kinds import KIND_INDEX
from vistel.implicit.primitives.polyblob_kernels import polyblob
from vistel.implicit.primitives.volume_kernels import volume
from vistel.implicit.rows.row_kernels import row

_POINTBLOB = KIND_INDEX["pointblob"]
_POINT_SETBLOB = KIND_INDEX["point_setblob"]
_POLYBLOB = KIND_INDEX["polyblob"]
_RAMP = KIND_INDEX["ramp"]


@row
def evaluate_kind(kind, p, x, y, z, u, gx, gy, gz, n, slope):
    """d^2 or F (`Kind.value`) and, where `slope`, its gradient of one primitive with the parameters p at n points."""
    if kind == _POINTBLOB:
        pointblob(p, x, y, z, u, gx, gy, gz, n, slope)
    elif kind == _POINT_SETBLOB:
        point_setblob(p, x, y, z, u, gx, gy, gz, n, slope)
    elif kind == _POLYBLOB:
        polyblob(p, x, y, z, u, gx, gy, gz, n, slope)
    elif kind == _RAMP:
        ramp(p, x, y, z, u, gx, gy, gz, n, slope)
    else:
        volume(kind, p, x, y, z, u, gx, gy, gz, n, slope)

"""Reads one C3D file and writes it as NPZ: `python -P c3d_reader.py FILE`. A script, because a package would load the mathematics.

On the standard output: `places` (F, P, 3) in the file's units, NaN where a point was not seen, `labels` (P,), `rate` in frames a
second, and `unit`; else exit code 1 and one line on the other.
"""

from __future__ import annotations

import io
import sys
from typing import Any

import numpy as np


def _main(path: str) -> int:
    """What `_read` reads, as NPZ on the standard output; else one line on the other."""
    try:
        import ezc3d  # noqa: PLC0415  not everybody has it
    except ImportError:
        sys.stderr.write("needs ezc3d: pip install 'vistel[c3d]'\n")
        return 1
    try:
        file: Any = ezc3d.c3d(path)
        points: Any = file["parameters"]["POINT"]
        places = np.array(file["data"]["points"], np.float64)[:3].transpose(2, 1, 0)
        seen = np.array(file["data"]["meta_points"]["residuals"], np.float64)[0].T >= 0.0
        places[~seen] = np.nan
        labels, units = list(points["LABELS"]["value"]), list(points.get("UNITS", {"value": []})["value"])
        rate = float(file["header"]["points"]["frame_rate"])
    except Exception as e:
        reason = str(e).splitlines()[0][:120] if str(e) else type(e).__name__
        sys.stderr.write(f"cannot be read as C3D, it is cut off or damaged: {reason}\n")
        return 1
    written = io.BytesIO()
    np.savez(written, places=places, labels=np.array(labels, str), rate=rate, unit=str(units[0] if units else ""))
    sys.stdout.buffer.write(written.getvalue())
    return 0


if __name__ == "__main__":
    sys.exit(_main(sys.argv[1]))

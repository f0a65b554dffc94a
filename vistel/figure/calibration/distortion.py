"""The distortion of a magnetic tracker by metal, measured over a grid and corrected.

A receiver near metal reads a pose that is off by an amount that depends on where it is, smoothly. Errors of position
(vector [m]) and of orientation (rotation vector [rad], transmitter frame) are kept at the corners of a grid over the
*measured* positions and interpolated trilinearly; outside the grid those of its edge hold.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy import sparse  # type: ignore[import-untyped]
from scipy.sparse import linalg  # type: ignore[import-untyped]

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix, rotvec_from_matrix

FORMAT = "vistel distortion 1"
SMOOTH = 0.05
"""Weight of differences between neighbouring corners relative to a sample: corners without samples near are filled in smoothly."""
MOST_CORNERS = 20_000


class DistortionError(ValueError):
    """Measurements or a file that cannot be used; one line: what, where, how to mend it."""


@dataclass(frozen=True)
class Distortion:
    """origin (3,): the first corner [m]; step [m]; errors (nx, ny, nz, 6): what a receiver read there less what is true,
    position [m] and rotation vector [rad]. Transmitter frame."""

    origin: F64
    step: float
    errors: F64

    def error_at(self, p: F64) -> F64:
        """(6,) error of a receiver that reads the position `p` (3,)."""
        corner, share = _cell(self, p)
        x, y, z = corner
        out = np.zeros(6)
        for k, weight in enumerate(_weights(share)):
            out += weight * self.errors[x + (k >> 2), y + (k >> 1 & 1), z + (k & 1)]
        return out

    def correct(self, p: F64, q: F64) -> tuple[F64, F64]:
        """The true pose of a receiver that reads position (3,) and quaternion (4,) x y z w."""
        error = self.error_at(p)
        turn = matrix_from_rotvec(-error[3:]) @ matrix_from_quaternion(q)
        return p - error[:3], quaternion_from_matrix(np.ascontiguousarray(turn))


@dataclass(frozen=True)
class Report:
    """Root mean square error of position [m] and orientation [rad]: as read, and corrected at points left out of the fit."""

    points: int
    before_m: float
    after_m: float
    before_rad: float
    after_rad: float


def _cell(grid: Distortion, p: F64) -> tuple[tuple[int, int, int], F64]:
    at = (p - grid.origin) / grid.step
    most = np.array(grid.errors.shape[:3]) - 1
    at = np.minimum(np.maximum(at, 0.0), most)
    low = np.minimum(at.astype(np.int64), np.maximum(most - 1, 0))
    return (int(low[0]), int(low[1]), int(low[2])), at - low


def _weights(share: F64) -> list[float]:
    """Of the eight corners of a cell, the last axis running fastest."""
    (a, b, c) = share.tolist()
    return [(a if k >> 2 else 1.0 - a) * (b if k >> 1 & 1 else 1.0 - b) * (c if k & 1 else 1.0 - c) for k in range(8)]


def pose_errors(true: tuple[F64, F64], read: tuple[F64, F64]) -> F64:
    """(n, 6) what receivers read less what is true; positions (n, 3), quaternions (n, 4)."""
    out = np.empty((len(true[0]), 6))
    out[:, :3] = read[0] - true[0]
    for k, (a, b) in enumerate(zip(true[1], read[1], strict=True)):
        out[k, 3:] = rotvec_from_matrix(matrix_from_quaternion(b) @ matrix_from_quaternion(a).T)
    return out


def fit_distortion(read: F64, errors: F64, step: float = 0.1) -> Distortion:
    """A grid over the measured positions `read` (n, 3) whose corners explain the (n, 6) `errors` seen there.

    Raises DistortionError where the points are too few or the grid would be too large.
    """
    if len(read) < 8:
        raise DistortionError(f"{len(read)} points are too few; measure at least 8, better 50, all over the space in use")
    low, high = read.min(axis=0), read.max(axis=0)
    counts = [max(2, math.ceil(float(span) / step) + 1) for span in high - low]
    corners = math.prod(counts)
    if corners > MOST_CORNERS:
        raise DistortionError(
            f"the points span {[round(float(v), 2) for v in high - low]} m: a grid of {step} m over that is too large; "
            "are they in metres? else choose a larger step"
        )
    grid = Distortion(0.5 * (low + high) - 0.5 * step * (np.array(counts) - 1.0), step, np.zeros((*counts, 6)))
    samples = _sample_rows(grid, read)
    pairs = _neighbours(grid)
    lib, solver = cast("Any", sparse), cast("Any", linalg)
    at = lib.csr_matrix((samples[1].ravel(), (np.repeat(np.arange(len(read)), 8), samples[0].ravel())), (len(read), corners))
    smooth = lib.csr_matrix(
        (np.tile([SMOOTH, -SMOOTH], len(pairs)), (np.repeat(np.arange(len(pairs)), 2), pairs.ravel())), (len(pairs), corners)
    )
    normal = (at.T @ at + smooth.T @ smooth + 1e-9 * lib.identity(corners)).tocsc()
    solved = np.asarray(solver.splu(normal).solve(np.asarray(at.T @ errors)), np.float64)
    return Distortion(grid.origin, step, solved.reshape(grid.errors.shape))


def _sample_rows(grid: Distortion, read: F64) -> tuple[NDArray[np.int64], F64]:
    """(n, 8) numbers of the corners round each point, and (n, 8) their weights."""
    _, ny, nz, _ = grid.errors.shape
    corners, weights = np.empty((len(read), 8), np.int64), np.empty((len(read), 8))
    for n, p in enumerate(read):
        (x, y, z), share = _cell(grid, p)
        corners[n] = [((x + (k >> 2)) * ny + y + (k >> 1 & 1)) * nz + z + (k & 1) for k in range(8)]
        weights[n] = _weights(share)
    return corners, weights


def _neighbours(grid: Distortion) -> NDArray[np.int64]:
    """(m, 2) numbers of corners next to each other."""
    shape = grid.errors.shape[:3]
    node: NDArray[np.int64] = np.arange(int(np.prod(shape)), dtype=np.int64).reshape(shape)
    along = [(node[:-1], node[1:]), (node[:, :-1], node[:, 1:]), (node[:, :, :-1], node[:, :, 1:])]
    return np.concatenate([np.stack((a.ravel(), b.ravel()), axis=1) for a, b in along])


def judge(read: F64, errors: F64, step: float = 0.1, folds: int = 5) -> Report:
    """How well a grid corrects points that it was not fitted on."""
    left = np.empty_like(errors)
    for f in range(folds):
        out = np.arange(len(read)) % folds == f
        grid = fit_distortion(read[~out], errors[~out], step)
        left[out] = errors[out] - np.array([grid.error_at(p) for p in read[out]])

    def rms(e: F64) -> float:
        return math.sqrt(float((e * e).sum(axis=1).mean()))

    return Report(len(read), rms(errors[:, :3]), rms(left[:, :3]), rms(errors[:, 3:]), rms(left[:, 3:]))


def save_distortion(grid: Distortion, path: Path) -> None:
    """Write it as JSON: format, origin [m], step [m], shape, errors (corner by corner, last axis fastest; m and rad)."""
    path.write_text(
        json.dumps(
            {
                "format": FORMAT,
                "origin": np.round(grid.origin, 6).tolist(),
                "step": grid.step,
                "shape": list(grid.errors.shape[:3]),
                "errors": np.round(grid.errors.reshape(-1, 6), 7).tolist(),
            }
        )
    )


def load_distortion(path: Path) -> Distortion:
    """Read such a file. Raises DistortionError."""
    try:
        data = json.loads(path.read_text("utf-8"))
        if data["format"] != FORMAT:
            raise DistortionError(f"{path}: is no {FORMAT}; make it with vistel calibrate distortion")
        shape = tuple(int(n) for n in data["shape"])
        errors = np.array(data["errors"], np.float64).reshape((*shape, 6))
        grid = Distortion(np.array(data["origin"], np.float64).reshape(3), float(data["step"]), errors)
    except OSError as e:
        raise DistortionError(f"{path}: cannot be read: {e.strerror}") from e
    except (ValueError, KeyError, TypeError) as e:
        if isinstance(e, DistortionError):
            raise
        raise DistortionError(f"{path}: is not a grid of errors: {e}; make it with vistel calibrate distortion") from e
    if min(shape) < 2 or not grid.step > 0.0 or not np.isfinite(grid.errors).all() or not np.isfinite(grid.origin).all():
        raise DistortionError(f"{path}: needs two corners or more along each axis, a step above 0, finite errors")
    return grid

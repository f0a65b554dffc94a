"""The calibration of one person's face in one helmet camera: positions of the marks at rest, and their colour."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, U8
from vistel.figure.face.marks import MARK_COUNT, MARKS, REST
from vistel.vision.assignment import assign
from vistel.vision.colour_key import FULL, ColourKey, background_moments, generic_green, mean_colour
from vistel.vision.spots import Spots, find_spots

_FIT_M = 0.008
"""Largest RMS distance of a person's marks from the standard face fitted to them [m]."""
_TILT_RAD = 0.6
_ENOUGH_FRAMES = 5


class FaceCalibrationError(ValueError):
    """Pictures or a file that cannot be used; one line: what, where, how to mend it."""


@dataclass(frozen=True)
class FaceCalibration:
    """width, height: of the pictures [px]. neutral: (13, 2) marks of the face at rest [px], order of `MARKS`. mass: of a
    mark [px of full key]. key: the marks' colour. wander_px: RMS movement of the marks while the face was still.
    misfit_mm: RMS distance of the marks from those of the standard face."""

    width: int
    height: int
    neutral: F64
    mass: float
    key: ColourKey
    wander_px: float = 0.0
    misfit_mm: float = 0.0

    def to_head(self) -> tuple[F64, F64]:
        """(2, 2) and (2,): the similarity from the neutral face to the standard one, pixels to metres."""
        return similarity(self.neutral, REST)


def similarity(source: F64, target: F64) -> tuple[F64, F64]:
    """Least-squares (2, 2), (2,) with target ≈ source @ m.T + t. Pictures have y down, heads y up, so m mirrors y. It also
    mirrors x if that fits better: a camera in front of a person has their left on its right."""
    s, t = source - source.mean(0), target - target.mean(0)
    best: tuple[float, F64] | None = None
    for flip in (np.array((1.0, -1.0)), np.array((-1.0, -1.0))):
        f = s * flip
        a = float((f * t).sum())
        b = float((f[:, 0] * t[:, 1] - f[:, 1] * t[:, 0]).sum())
        n = max(float((f * f).sum()), 1e-12)
        m = np.array(((a, -b), (b, a))) / n @ np.diag(flip)
        error = float((((s @ m.T) - t) ** 2).sum())
        if best is None or error < best[0]:
            best = error, m
    assert best is not None
    m = best[1]
    return m, target.mean(0) - m @ source.mean(0)


def calibrate_face(frames: Sequence[U8], *, mirrored: bool = False) -> FaceCalibration:
    """From pictures (h, w, 3) BGR of a still, neutral face with all 13 marks in sight. mirrored: the picture shows the
    person's left on its left. Raises FaceCalibrationError."""
    if not frames:
        raise FaceCalibrationError("the clip has no pictures; is the file a video, and not empty?")
    neutral: list[F64] = []
    masses: list[float] = []
    key: ColourKey | None = None
    counts: list[int] = []
    for frame in frames:
        if frame.shape != frames[0].shape:
            raise FaceCalibrationError("the clip's pictures differ in size; use one take of one camera")
        key = key or first_key(frame)
        if key is None:
            counts.append(0)
            continue
        spots = find_spots(key.apply(frame), FULL)
        counts.append(len(spots))
        found = name_marks(spots, mirrored=mirrored)
        if found is None:
            continue
        neutral.append(spots.centre[found])
        masses.append(float(np.median(spots.mass[found])))
        key = _learn(key, frame, spots, found, 1.0 / len(neutral))
    if key is None or len(neutral) < min(_ENOUGH_FRAMES, len(frames)):
        raise FaceCalibrationError(
            f"all {MARK_COUNT} marks were identified in {len(neutral)} of {len(frames)} pictures (green spots seen: "
            f"{int(np.median(counts))}); light the face evenly, take other green things out of the picture, look neutral"
        )
    at = np.stack(neutral)
    middle = np.median(at, 0)
    near = np.abs(at - middle).max((1, 2)) < 6.0
    still = at[near] if near.any() else at
    m, t = similarity(still.mean(0), REST)
    fit = still.mean(0) @ m.T + t - REST
    height, width = frames[0].shape[:2]
    return FaceCalibration(
        width,
        height,
        still.mean(0),
        float(np.median(masses)),
        key,
        float(np.sqrt(((at - still.mean(0)) ** 2).sum(2).mean())),
        1e3 * float(np.sqrt((fit**2).sum(1).mean())),
    )


def first_key(frame: U8) -> ColourKey | None:
    """A key from one picture, with strong greens as marks; None if there are none."""
    mask = generic_green(frame)
    colour = mean_colour(frame, mask)
    if not np.isfinite(colour).all():
        return None
    return ColourKey(colour, background_moments(frame, mask))


def _learn(key: ColourKey, frame: U8, spots: Spots, found: NDArray[np.int64], share: float) -> ColourKey:
    """The key, adapted to the marks and background of this picture."""
    mask = marks_mask(key.apply(frame), spots, found)
    colour = mean_colour(frame, mask)
    if not np.isfinite(colour).all():
        return key
    return key.adapted(colour, background_moments(frame, mask), share)


def marks_mask(key: U8, spots: Spots, which: NDArray[np.int64]) -> U8:
    """(h, w) 255 within the spots `which`, where the key is more than half."""
    mask = np.zeros_like(key)
    for x, y, w, h in spots.box[which]:
        _, mask[y : y + h, x : x + w] = cv2.threshold(key[y : y + h, x : x + w], 0.5 * FULL, 255, cv2.THRESH_BINARY)
    return mask


def name_marks(spots: Spots, *, mirrored: bool = False) -> NDArray[np.int64] | None:
    """(13,) the spot of each mark of a roughly neutral face anywhere in the picture; None if they do not fit.

    Every pair of spots is tried as the two outer brows; the standard face fitted to them gives the spots of the others.
    """
    n = len(spots)
    if not MARK_COUNT <= n <= 4 * MARK_COUNT:
        return None
    # +x the person's left, +y up. A camera in front of the person has their left on the right of its picture.
    at = spots.centre * (-1.0 if mirrored else 1.0, -1.0)
    left, right = REST[MARKS.index("left_outer_brow")], REST[MARKS.index("right_outer_brow")]
    i, j = np.nonzero(~np.eye(n, dtype=bool))
    z = at[:, 0] + 1j * at[:, 1]
    model = REST[:, 0] + 1j * REST[:, 1]
    wide = complex(*(left - right))
    turn = (z[i] - z[j]) / wide  # pixels per metre, and tilt
    upright = (np.abs(np.angle(turn)) < _TILT_RAD) & (np.abs(turn) > 200.0)
    i, turn = i[upright], turn[upright]
    if not len(i):
        return None
    laid = z[i][:, None] + turn[:, None] * (model - complex(*left))[None]
    miss = np.abs(laid[:, :, None] - z[None, None]).min(2) / np.abs(turn)[:, None]
    best = int(np.minimum(miss, 0.03).sum(1).argmin())
    where, size = laid[best], float(np.abs(turn[best]))
    columns = np.zeros(MARK_COUNT, np.int64)
    for _ in range(4):
        columns = assign(np.minimum(np.abs(where[:, None] - z[None]) / size, 0.05))
        a, b = _fit(model, z[columns])
        where, size = a * model + b, float(abs(a))
    if np.sqrt((np.abs(where - z[columns]) ** 2).mean()) / size > _FIT_M:
        return None
    return columns


def _fit(source: NDArray[np.complex128], target: NDArray[np.complex128]) -> tuple[complex, complex]:
    """The least-squares similarity a z + b."""
    s, t = source - source.mean(), target - target.mean()
    a = complex((s.conj() @ t) / (s.conj() @ s).real)
    return a, complex(target.mean() - a * source.mean())


def write_face(path: Path, calibration: FaceCalibration) -> None:
    """As JSON. Raises OSError."""
    c = calibration
    data: dict[str, Any] = {
        "width": c.width,
        "height": c.height,
        "marks": dict(zip(MARKS, np.round(c.neutral, 3).tolist(), strict=True)),
        "mass": round(c.mass, 2),
        "mark_bgr": np.round(c.key.mark, 2).tolist(),
        "background": np.round(c.key.background, 2).tolist(),
        "wander_px": round(c.wander_px, 4),
        "misfit_mm": round(c.misfit_mm, 4),
    }
    path.write_text(json.dumps(data, indent=1) + "\n", "utf-8")


def read_face(path: Path) -> FaceCalibration:
    """Raises FaceCalibrationError."""
    try:
        data = json.loads(path.read_text("utf-8"))
        out = FaceCalibration(
            int(data["width"]),
            int(data["height"]),
            np.array([data["marks"][m] for m in MARKS], np.float64),
            float(data["mass"]),
            ColourKey(np.array(data["mark_bgr"], np.float64), np.array(data["background"], np.float64)),
            float(data.get("wander_px", 0.0)),
            float(data.get("misfit_mm", 0.0)),
        )
    except OSError as e:
        raise FaceCalibrationError(f"{path}: cannot be read: {e.strerror}") from e
    except (ValueError, KeyError, TypeError) as e:
        raise FaceCalibrationError(f"{path}: not a face calibration ({e!r}); make one with vistel calibrate face") from e
    shapes = out.neutral.shape, out.key.mark.shape, out.key.background.shape
    numbers = np.concatenate((out.neutral.ravel(), out.key.mark, out.key.background.ravel(), (out.mass,)))
    if shapes != ((MARK_COUNT, 2), (3,), (3, 3)) or not np.isfinite(numbers).all() or out.mass <= 0.0:
        raise FaceCalibrationError(f"{path}: its numbers are no face calibration; make it anew with vistel calibrate face")
    return out

"""Masks of skin by place: where blood, sun, grease and age show, palms and soles. Places are told from the left eye of a usual
person [m]: |x| from the middle of the face, y up, z forward."""

import itertools

import numpy as np
from scipy.interpolate import make_interp_spline

from vistel.arrays import F64
from vistel.geometry.smoothstep import smooth

_FINGERS = ("index", "middle", "ring", "little")
_CREASES: tuple[tuple[float, float, tuple[tuple[float, float], ...]], ...] = (
    # Depth, half width [m], and the line as (|x|, y): forehead, between the brows, beside and under the eye, nose to mouth to chin.
    *((0.55, 0.0011, ((0.0, y), (0.012, y + 0.001), (0.027, y + 0.0035), (0.040, y))) for y in (0.040, 0.0495, 0.059)),
    (0.6, 0.0010, ((0.008, 0.034), (0.0065, 0.017))),
    *((0.5, 0.0009, ((0.049, -0.003 + 0.004 * a), (0.059, -0.003 + 0.011 * a), (0.064, -0.004 + 0.016 * a)))
      for a in (-1.1, -0.45, 0.2, 0.85)),
    (0.5, 0.0012, ((0.013, -0.008), (0.021, -0.0155), (0.031, -0.0175), (0.042, -0.0125))),
    (0.35, 0.0014, ((0.014, -0.015), (0.024, -0.024), (0.036, -0.027))),
    (0.9, 0.0022, ((0.0195, -0.040), (0.0255, -0.051), (0.0305, -0.064), (0.0315, -0.076))),
    (0.6, 0.0017, ((0.0255, -0.070), (0.0285, -0.082), (0.0285, -0.096))),
)  # fmt: skip
_NECK = (-0.150, -0.172)
"""Heights of the rings round a neck's front."""


def places(p: F64, joints: dict[str, F64]) -> F64:
    """(N, 3) of points (N, 3) as the module tells them."""
    eye = joints["left_eye"]
    return np.column_stack([np.abs(p[:, 0]), p[:, 1] - eye[1], p[:, 2] - eye[2]])


def skin_masks(p: F64, normal: F64, joints: dict[str, F64]) -> dict[str, F64]:
    """(N,) 0 to 1 by name, of points (N, 3) with normals."""
    q = places(p, joints)
    front = smooth((q[:, 2] + 0.035) / 0.02) * smooth((q[:, 1] + 0.20) / 0.02)
    return {
        "flush": _flush(p, q, joints),
        "sun": _spots(
            q, ((0.8, (0.036, -0.028, 0.008), 0.021), (1.0, (0.0, -0.024, 0.036), 0.019), (0.4, (0.0, 0.045, 0.02), 0.030))
        ),
        "oil": _spots(q, ((0.8, (0.0, 0.048, 0.02), 0.026), (1.0, (0.0, -0.03, 0.04), 0.015), (0.6, (0.0, -0.098, 0.02), 0.014))),
        "lids": front * np.exp(-np.square((q[:, 0] - 0.0285) / 0.017) - np.square((q[:, 1] + 0.001) / 0.0115)) * (q[:, 2] > -0.02),
        "folds": _folds(q) * front,
        "palms": _palms(p, normal, joints),
    }


def _spots(q: F64, spots: tuple[tuple[float, tuple[float, float, float], float], ...]) -> F64:
    return sum((share * np.exp(-np.square(q - at).sum(axis=1) / radius**2) for share, at, radius in spots), np.zeros(len(q)))


def _flush(p: F64, q: F64, joints: dict[str, F64]) -> F64:
    """Where blood shows: cheeks, nose, chin, ears, knuckles and tips of fingers, knees, toes."""
    out = _spots(q, ((0.55, (0.041, -0.033, 0.004), 0.025), (0.8, (0.0, -0.038, 0.040), 0.014), (0.4, (0.0, -0.098, 0.02), 0.016),
                     (0.7, (0.078, -0.012, -0.070), 0.026), (0.4, (0.014, -0.004, 0.015), 0.007)))  # fmt: skip
    for side in ("left", "right"):
        for finger in _FINGERS:
            for k, digit in enumerate(("proximal", "intermediate", "distal")):
                out += (0.5 + 0.15 * k) * np.exp(-np.square(p - joints[f"{side}_{finger}_{digit}"]).sum(axis=1) / 0.015**2)
        out += 0.4 * np.exp(-np.square(p - joints[f"{side}_lower_leg"]).sum(axis=1) / 0.06**2)
        out += 0.4 * np.exp(-np.square(p - joints[f"{side}_toes"]).sum(axis=1) / 0.05**2)
    return out


def _folds(q: F64) -> F64:
    """How deep creases are that come with age."""
    out = np.zeros(len(q))
    for depth, half, line in _CREASES:
        away, along = _from_line(q[:, :2], _curve(np.array(line)))
        ends = smooth(4.0 * along + 0.25) * smooth(4.0 * (1.0 - along) + 0.25)
        out = np.maximum(out, depth * ends * np.exp(-np.square(away / half)))
    for y in _NECK:
        out = np.maximum(out, 0.5 * np.exp(-np.square((q[:, 1] - y - 4.0 * q[:, 0] ** 2) / 0.0018)))
    return out


def _curve(line: F64) -> F64:
    """(17, 2) on a smooth curve through some points."""
    at = np.arange(len(line))
    return make_interp_spline(at, line, k=min(3, len(line) - 1))(np.linspace(0.0, at[-1], 17))


def _from_line(p: F64, line: F64) -> tuple[F64, F64]:
    """(N,) distances from a line of points, and how far along it the nearest place is, 0 to 1."""
    best, at = np.full(len(p), np.inf), np.zeros(len(p))
    for k, (a, b) in enumerate(itertools.pairwise(line)):
        t = np.clip((p - a) @ (b - a) / np.square(b - a).sum(), 0.0, 1.0)
        away = np.linalg.norm(p - a - t[:, None] * (b - a), axis=1)
        nearer = away < best
        best, at = np.where(nearer, away, best), np.where(nearer, (k + t) / (len(line) - 1), at)
    return best, at


def _palms(p: F64, normal: F64, joints: dict[str, F64]) -> F64:
    """Insides of hands, and soles."""
    out = smooth((0.05 - p[:, 1]) / 0.02) * smooth((-normal[:, 1] - 0.2) / 0.5)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        names = ("hand", "index_proximal", "little_proximal", "middle_proximal")
        wrist, index, little, middle = (joints[f"{side}_{name}"] for name in names)
        along = (middle - wrist) / np.linalg.norm(middle - wrist)
        inside = sign * np.cross(along, index - little)
        inside /= np.linalg.norm(inside)
        on = smooth(((p - wrist) @ along - 0.005) / 0.02) * (np.linalg.norm(p - middle, axis=1) < 0.16)
        out = np.maximum(out, on * smooth((normal @ inside + 0.1) / 0.6))
    return out

"""The colours of skin, lips, brows, lids and nails at points of the reference person's surface."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F64
from vistel.figure.people.head import EYE, EYE_HALF_WIDTH, MOUTH_Y, eye_half_height
from vistel.figure.people.noise_kernels import bump, noise
from vistel.figure.people.recipe import Recipe
from vistel.figure.skeleton import FINGERS, JOINT_INDEX, finger_joints, standard_skeleton
from vistel.geometry.smoothstep import smoothstep

_SKELETON = standard_skeleton()


def paint_skin(r: Recipe, p: F64, normal: F64) -> F64:
    """(N, 3) sRGB 0..255 of bare skin at points (N, 3) with outward normals (N, 3)."""
    base = np.array(r.colour("skin"), np.float64)
    out = np.tile(base, (len(p), 1))
    mottle = noise(p / 0.035, 3, r.seed)
    fine = noise(p / 0.0035, 2, r.seed + 7)
    blotch = noise(p / 0.011, 2, r.seed + 13)
    out *= (1.0 + 0.030 * mottle + 0.030 * fine)[:, None]
    dark = 1.0 - base.mean() / 255.0
    red = 0.55 * bump(p, (0.046, 1.603, 0.078), 0.016) + 0.60 * bump(p, (0.0, 1.606, 0.124), 0.011)
    red += 0.50 * bump(p, (0.080, 1.636, -0.008), 0.020) + 0.25 * bump(p, (0.0, 1.528, 0.096), 0.012)
    hand = np.abs(p[:, 0]) > 0.70
    red[hand] += _hand_redness(p[hand], normal[hand])
    red = np.clip(red + 0.12 * mottle + 0.22 * blotch, -0.4, 1.2)
    tint = np.array((0.05, -0.16, -0.15)) * (1.0 - 0.45 * dark)
    out *= 1.0 + red[:, None] * tint
    head = (p[:, 1] > 1.49) & (np.abs(p[:, 0]) < 0.2)
    out[head] = _face(r, p[head], normal[head], out[head])
    out[hand] = _nails(r, p[hand], normal[hand], out[hand])
    return out


def paint_lip(r: Recipe, p: F64, normal: F64) -> F64:
    """(N, 3) colours of the lips."""
    base = np.array(r.colour("skin"), np.float64)
    strength = 0.50 + 0.22 * r.female
    lip = base * (1.0 + strength * np.array((-0.10, -0.34, -0.30)))
    lines = noise(np.stack([p[:, 0] / 0.0011, p[:, 1] / 0.006, p[:, 2] / 0.006], axis=1), 1, r.seed + 3)
    out = lip * (1.0 + 0.06 * lines)[:, None]
    return _mouth_line(p, out)


def _mouth_line(p: F64, out: F64) -> F64:
    x = np.abs(p[:, 0])
    middle = MOUTH_Y + 0.0002 + 0.0008 * (x / 0.026) ** 2
    line = np.exp(-(((p[:, 1] - middle) / 0.0010) ** 2)) * smoothstep(0.0248, 0.0222, x) * (p[:, 2] > 0.06)
    return out * (1.0 - line[:, None] * np.array((0.55, 0.68, 0.66)))


def _face(r: Recipe, p: F64, normal: F64, out: F64) -> F64:
    x, y, z = np.abs(p[:, 0]), p[:, 1], p[:, 2]
    hair = np.array(r.colour("hair"), np.float64)
    # Round the eyes: darker hollows, crease of the lid, lashes at its edge, the red inside.
    dx, dy = x - EYE[0], y - (EYE[1] - 0.0004)
    front = z > EYE[2] - 0.004
    hollow = bump(p, (0.020, 1.649, 0.096), 0.008) + 0.6 * bump(p, (0.030, 1.633, 0.096), 0.008)
    out = out * (1.0 - hollow[:, None] * np.array((0.10, 0.13, 0.10)))
    k = ((np.abs(dx) / EYE_HALF_WIDTH) ** 1.75 + (np.abs(dy) / eye_half_height(r)) ** 1.75) ** (1 / 1.75)
    ring = np.hypot(dx / 0.0150, (dy - 0.0002) / 0.0083)
    crease = np.exp(-(((ring - 1.0) / 0.075) ** 2)) * (dy > 0.001) * front
    out = out * (1.0 - 0.26 * crease[:, None])
    lash = np.exp(-(((k - 1.06) / 0.13) ** 2)) * front
    upper = smoothstep(-0.0006, 0.0012, dy)
    strength = lash * (0.30 + (0.52 + 0.25 * r.female) * upper)
    out = out * (1.0 - strength[:, None]) + strength[:, None] * (0.35 * hair + 6.0)
    # Brows: an arc of single hairs.
    u = (x - 0.0120) / (0.0500 - 0.0120)
    arch = 0.0052 + 0.0022 * r.female
    middle = 1.6615 + arch * np.sin(np.clip(u, 0, 1) ** 0.9 * 2.25) - 0.0010
    thick = (0.0046 - 0.0026 * np.clip(u, 0, 1)) * (1.0 - 0.28 * r.female)
    strands = noise(
        np.stack([x / 0.0011 + 1.2 * (y - middle) / 0.0011, (y - middle) / 0.0045, np.zeros(len(x))], axis=1), 2, r.seed + 11
    )
    brow = smoothstep(1.25, 0.45, np.abs(y - middle) / thick + 0.22 * strands)
    brow *= smoothstep(-0.06, 0.06, u) * smoothstep(1.04, 0.86, u) * (z > 0.03) * (0.86 + 0.14 * strands)
    tone = 0.72 * hair if hair.mean() < 130 else 0.62 * hair
    out = out * (1.0 - 0.88 * brow[:, None]) + 0.88 * brow[:, None] * tone
    # Nostrils, corners and line of the mouth.
    nostril = np.exp(-0.5 * (((x - 0.0066) / 0.0030) ** 2 + ((y - 1.5940) / 0.0034) ** 2 + ((z - 0.1085) / 0.0050) ** 2) ** 1.5)
    out = out * (1.0 - 0.70 * nostril[:, None])
    wing = np.exp(-(((np.hypot(x - 0.0128, (y - 1.6010) * 0.95) - 0.0085) / 0.0018) ** 2)) * (x > 0.015) * (z > 0.085)
    out = out * (1.0 - 0.14 * wing[:, None])
    out = _mouth_line(p, out)
    if r.female < 0.5:
        # Shadow of the shaved beard.
        jaw = smoothstep(1.596, 1.570, y) * smoothstep(1.500, 1.522, y) * smoothstep(-0.010, 0.030, z)
        side = smoothstep(0.022, 0.034, x) * smoothstep(1.625, 1.60, y)
        beard = np.clip(np.maximum(jaw * smoothstep(1.600, 1.585, y), jaw * side), 0, 1)
        beard *= 1.0 + 0.25 * noise(p / 0.0012, 1, r.seed + 5)
        amount = 0.14 + 0.10 * (1.0 - hair.mean() / 255.0)
        out = out * (1.0 - amount * beard[:, None]) + amount * beard[:, None] * (0.5 * hair + (28, 30, 34))
    return out


def _hand_redness(p: F64, normal: F64) -> F64:
    red = np.zeros(len(p))
    for finger in FINGERS:
        for joint in [j for j in finger_joints("left") if finger in j]:
            at = _SKELETON.rest[JOINT_INDEX[joint]]
            red += 0.35 * bump(p, (float(at[0]), float(at[1]), float(at[2])), 0.0065)
    palm = smoothstep(-0.2, -0.7, normal[:, 1])
    tips = smoothstep(0.90, 0.925, np.abs(p[:, 0]))
    return red + 0.30 * palm + 0.25 * tips


def _nails(r: Recipe, p: F64, normal: F64, out: F64) -> F64:
    out = out.copy()
    base = np.array(r.colour("skin"), np.float64)
    nail = 0.62 * base + 0.38 * np.array((250.0, 206.0, 200.0))
    mirror = np.stack([np.sign(p[:, 0]), np.ones(len(p)), np.ones(len(p))], axis=1)
    for i, finger in enumerate(FINGERS):
        joints = [JOINT_INDEX[j] for j in finger_joints("left")[3 * i : 3 * i + 3]]
        root, tip = _SKELETON.rest[joints[2]], _SKELETON.tip[joints[2]]
        length = float(np.linalg.norm(tip))
        along = tip / length
        across = np.cross(along, (0.0, 1.0, 0.0))
        across /= np.linalg.norm(across)
        up = np.cross(across, along)
        here = np.flatnonzero(np.abs((p * mirror - root) @ across) < 0.0085)
        left, n = p[here] * mirror[here], normal[here] * mirror[here]
        q = left - root
        u, v, w = q @ along, q @ across, q @ up
        half = 0.0058 if finger == "thumb" else 0.0046 - 0.0006 * (finger == "little")
        square = (np.abs((u - 0.70 * length) / (0.27 * length)) ** 3.2 + np.abs(v / half) ** 3.2) ** (1 / 3.2)
        near = (u > 0.2 * length) & (u < 1.25 * length) & (w > 0.0) & (n @ up > 0.25)
        plate = (smoothstep(1.05, 0.92, square) * near)[:, None]
        rim = np.exp(-(((square - 1.04) / 0.07) ** 2)) * near
        free = smoothstep(0.90, 0.94, u / length)[:, None] * plate
        colour = out[here] * (1.0 - 0.16 * rim[:, None])
        colour = colour * (1.0 - plate) + plate * nail
        colour = colour * (1.0 - 0.6 * free) + 0.6 * free * np.array((244.0, 232.0, 222.0))
        for joint in joints[1:]:  # creases over the joints
            d = (left - _SKELETON.rest[joint]) @ along
            wave = np.cos(d / 0.0016 * np.pi) * np.exp(-((d / 0.0040) ** 2)) * (np.abs(w) < 0.014)
            colour *= 1.0 - 0.07 * wave[:, None]
        out[here] = colour
    return out

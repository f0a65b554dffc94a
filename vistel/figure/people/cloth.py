"""The colours of clothes: knit, stripes, checks, jacket and shirt, trousers, shoes. Reference person's surface."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F64
from vistel.figure.people.noise_kernels import noise
from vistel.figure.people.recipe import Recipe
from vistel.figure.people.trunk import ARM_Y, HEM_Y
from vistel.geometry.smoothstep import smoothstep

# Patterns of the upper garment (`Recipe.pattern`).
PLAIN = 0
KNIT = 1
STRIPES = 2
CHECKS = 3
JACKET = 4  # over a shirt
_ARMHOLE = 0.172


def _cloth(r: Recipe) -> F64:
    """Colour of the upper garment; jackets are darker and quieter than jumpers."""
    base = np.array(r.colour("top"), np.float64)
    return 0.48 * base + 0.52 * np.array((34.0, 36.0, 42.0)) if r.pattern == JACKET else base


def _line(x: F64, width: float) -> F64:
    """1 on x = 0, falling off over `width`."""
    return np.exp(-((x / width) ** 2))


def _contrast(colour: F64) -> F64:
    """A second colour that goes with the first: light with dark, dark with light."""
    if colour.mean() > 140:
        return 0.42 * colour + np.array((6.0, 10.0, 22.0))
    return 0.35 * colour + 0.65 * np.array((236.0, 230.0, 216.0))


def _folds(p: F64, seed: int) -> F64:
    """(N,) soft light and dark of cloth that hangs: folds round elbows, waist and armpits, about -1..1."""
    x, y = np.abs(p[:, 0]), p[:, 1]
    around = noise(np.stack([p[:, 0] / 0.055, y / 0.030, p[:, 2] / 0.055], axis=1), 2, seed)
    sleeve = noise(np.stack([p[:, 0] / 0.022, y / 0.05, p[:, 2] / 0.05], axis=1), 2, seed + 1)
    arm = smoothstep(0.20, 0.26, x)
    elbow = 0.35 + 0.65 * np.exp(-(((x - 0.47) / 0.06) ** 2))
    waist = 0.45 + 0.55 * np.exp(-(((y - 1.08) / 0.06) ** 2))
    return arm * sleeve * elbow + (1 - arm) * around * waist


def paint_top(r: Recipe, p: F64, normal: F64) -> F64:
    """(N, 3) sRGB 0..255 of the upper garment."""
    base = _cloth(r)
    second = _contrast(base)
    x, y, z = p[:, 0], p[:, 1], p[:, 2]
    side = np.abs(x)
    sleeve = (side > _ARMHOLE) & (y > 1.26)  # wide hips are no sleeves
    # Cloth coordinates in metres: round the body and up it, or round the arm and along it.
    over = smoothstep(1.32, 1.42, y)  # over the shoulders the cloth lies flat: across, and from front to back
    body = np.where(z > 0, 1.0, -1.0) * over * x * 1.25 + (1.0 - over) * np.arctan2(x, z) * 0.145
    u = np.where(sleeve, np.arctan2(z, y - ARM_Y) * 0.050, body)
    v = np.where(sleeve, side, y - over * 0.8 * (np.abs(z + 0.01) - 0.09))
    out = np.tile(base, (len(p), 1))
    weave = noise(p / 0.0022, 1, r.seed + 21)
    shade = 0.045 * weave
    if r.pattern == KNIT:
        stitch = 0.0062
        row, column = v / stitch, u / stitch
        vee = np.sin(2 * np.pi * (row + np.abs((column % 1.0) - 0.5)))
        shade += 0.085 * vee + 0.06 * (np.abs((column % 1.0) - 0.5) * 2 - 0.5)
        cable = _line(np.abs(u) - 0.045, 0.010) * (~sleeve) * (z > 0)
        shade += 0.10 * cable * np.sin(2 * np.pi * v / 0.035 + np.sign(u) * 1.5 + u / 0.006)
    elif r.pattern == STRIPES:
        period = 0.042
        band = smoothstep(-0.16, 0.16, np.sin(2 * np.pi * v / period) - 0.35)
        out = out * (1 - band[:, None]) + band[:, None] * second
    elif r.pattern == CHECKS:
        warp = smoothstep(0.2, 0.4, np.sin(2 * np.pi * u / 0.056))
        weft = smoothstep(0.2, 0.4, np.sin(2 * np.pi * v / 0.056))
        thin = np.maximum(_line((u % 0.056) - 0.042, 0.0016), _line((v % 0.056) - 0.042, 0.0016))
        out *= (1.0 - 0.26 * warp)[:, None]
        out *= (1.0 - 0.26 * weft)[:, None]
        out = out * (1 - 0.55 * thin[:, None]) + 0.55 * thin[:, None] * second
    if r.pattern in (PLAIN, CHECKS):
        out = _placket(out, base, x, y, z)
    if r.pattern == JACKET:
        out = _jacket(r, out, base, x, y, z)
    else:
        # Ribs at hem and cuffs of a jumper, a stitched hem otherwise.
        ribbed = np.maximum(smoothstep(HEM_Y + 0.050, HEM_Y + 0.046, y) * (side < 0.22), smoothstep(0.684, 0.687, side))
        if r.pattern in (KNIT, STRIPES):
            shade = shade * (1 - ribbed) + ribbed * 0.13 * np.sin(2 * np.pi * u / 0.0052)
        else:
            shade -= 0.20 * _line(y - HEM_Y - 0.018, 0.0010) * (side < 0.22) + 0.20 * _line(side - 0.690, 0.0010)
    seam = _line(side - _ARMHOLE, 0.0013) * (y > 1.26) + _line(z + 0.004, 0.0010) * (side > 0.10) * (side < _ARMHOLE) * (y < 1.33)
    seam += _line(z + 0.004, 0.0010) * (y < ARM_Y - 0.01) * sleeve + _line(z + 0.012, 0.0012) * (y > 1.43) * ~sleeve
    shade += 0.075 * _folds(p, r.seed + 31) - 0.30 * np.clip(seam, 0, 1)
    return out * (1.0 + shade)[:, None]


def _placket(out: F64, base: F64, x: F64, y: F64, z: F64) -> F64:
    """Button strip, buttons and a breast pocket of a shirt."""
    front = z > 0.02
    edge = (_line(np.abs(x) - 0.017, 0.0011)) * front
    out = out * (1 - 0.28 * edge[:, None])
    below = (1.435 - y) % 0.085
    button = smoothstep(0.0056, 0.0048, np.hypot(x, below - 0.02)) * front * (y < 1.425) * (y > HEM_Y + 0.02)
    holes = smoothstep(0.0012, 0.0007, np.abs(np.hypot(x, below - 0.02) - 0.0016))
    light = np.array((232.0, 228.0, 218.0)) if base.mean() < 190 else np.array((120.0, 112.0, 104.0))
    out = out * (1 - button[:, None]) + (button * (1 - 0.4 * holes))[:, None] * light
    pocket = np.maximum(np.abs(x - 0.082) / 0.048, np.abs(y - 1.290) / 0.055 + 0.10 * np.abs(x - 0.082) / 0.048 * (y < 1.29))
    outline = np.maximum(_line((pocket - 1.0) * 0.05, 0.0012), 0.8 * _line(y - 1.327, 0.0010) * (pocket < 1.0)) * front
    return out * (1 - 0.24 * outline[:, None])


def _jacket(r: Recipe, out: F64, base: F64, x: F64, y: F64, z: F64) -> F64:
    """A jacket open over a light shirt, with lapels, a tie for some, two buttons and flapped pockets."""
    front = (z > 0.0) & (np.abs(x) < _ARMHOLE)
    side = np.abs(x)
    opening = np.clip((y - 1.175) / (1.470 - 1.175), 0.0, 1.0)
    half = 0.070 * opening**0.9
    shirt = (smoothstep(0.0012, -0.0012, side - half) * front * (y > 1.170))[:, None]
    linen = np.array((226.0, 230.0, 238.0)) if base.mean() < 150 else np.array((112.0, 132.0, 168.0))
    inner = np.tile(linen, (len(x), 1)) * (1 - 0.16 * _line(side - 0.014, 0.0010))[:, None]
    button = smoothstep(0.0048, 0.0042, np.hypot(x, ((1.44 - y) % 0.075) - 0.03))
    inner = inner * (1 - 0.25 * button[:, None])
    if r.female < 0.5:
        tie_half = 0.012 + 0.020 * np.clip((1.440 - y) / 0.26, 0.0, 1.0)
        tie_half = np.where(y > 1.437, 0.020, tie_half)
        tie = smoothstep(0.0010, -0.0010, side - tie_half)[:, None]
        cloth = np.array(((122.0, 28.0, 36.0), (26.0, 58.0, 96.0), (52.0, 84.0, 60.0))[r.seed % 3])
        stripe = smoothstep(-0.1, 0.1, np.sin(2 * np.pi * (x + y) / 0.022) - 0.55)
        inner = inner * (1 - tie) + tie * cloth * (1 + 0.35 * stripe[:, None]) * (1 - 0.35 * _line(y - 1.437, 0.0015))[:, None]
    # Lapels: a lighter band along the opening with a notch.
    width = 0.060 * smoothstep(1.175, 1.34, y)
    notch = _line(y - 1.375 + 0.25 * (side - half - 0.03), 0.0016) * (side > half + 0.022)
    lapel = smoothstep(0.0010, -0.0010, side - half - width) * front * (y > 1.18)
    rim = _line(side - half - width, 0.0016) * front * (y > 1.18) + _line(side - half, 0.0014) * front * (y > 1.18)
    out = out * (1 + 0.07 * lapel - 0.45 * np.clip(rim, 0, 1) - 0.5 * notch * lapel)[:, None]
    edge = _line(x - 0.010, 0.0013) * front * (y < 1.178)
    knobs = smoothstep(0.0080, 0.0070, np.minimum(np.hypot(x + 0.006, y - 1.155), np.hypot(x + 0.006, y - 1.065))) * front
    flap = np.maximum(np.abs(side - 0.098) / 0.060, np.abs(y - 1.045) / 0.022)
    pocket = _line((flap - 1.0) * 0.03, 0.0012) * front
    welt = np.maximum(np.abs(x - 0.095) / 0.042, np.abs(y - 1.300 - 0.10 * (x - 0.095)) / 0.010)
    pocket = np.maximum(pocket, _line((welt - 1.0) * 0.02, 0.0012) * front)
    out = out * (1 - 0.5 * edge - 0.38 * pocket)[:, None]
    out = out * (1 - knobs[:, None]) + knobs[:, None] * np.array((34.0, 30.0, 28.0))
    return out * (1 - shirt) + shirt * inner


def paint_collar(r: Recipe, p: F64, normal: F64) -> F64:
    """(N, 3) colours of the ring round the neck."""
    base = _cloth(r)
    if r.pattern == JACKET:
        base = np.array((226.0, 230.0, 238.0)) if base.mean() < 150 else np.array((112.0, 132.0, 168.0))
    ribs = np.sin(np.arctan2(p[:, 0], p[:, 2] + 0.016) * 0.062 * 2 * np.pi / 0.0052)
    ribbed = 0.12 * ribs if r.pattern in (KNIT, STRIPES) else 0.04 * noise(p / 0.0022, 1, r.seed)
    gap = _line(p[:, 0], 0.0018) * (p[:, 2] > 0) * (r.pattern in (PLAIN, CHECKS, JACKET))
    return np.tile(base, (len(p), 1)) * (1.04 + ribbed - 0.45 * gap)[:, None]


def paint_trousers(r: Recipe, p: F64, normal: F64) -> F64:
    """(N, 3) colours of the trousers: twill, seams, pockets, fly."""
    base = np.array(r.colour("trousers"), np.float64)
    x, y, z = p[:, 0], p[:, 1], p[:, 2]
    side = np.abs(x)
    twill = np.sin((x + y * 1.0 + z) * 2 * np.pi / 0.0042)
    shade = 0.030 * twill + 0.035 * noise(p / 0.0030, 1, r.seed + 41)
    folds = noise(np.stack([x / 0.05, y / 0.026, z / 0.05], axis=1), 2, r.seed + 43)
    knee = np.exp(-(((y - 0.50) / 0.055) ** 2)) + np.exp(-(((y - 0.12) / 0.06) ** 2)) + np.exp(-(((y - 0.86) / 0.04) ** 2))
    shade += 0.085 * folds * np.clip(0.25 + knee, 0, 1)
    seam = _line(z + 0.006, 0.0012) * (side > 0.09) + _line(z + 0.006, 0.0012) * (side < 0.09) * (y < 0.80)
    pocket = _line(side - 0.105 - 0.055 * np.clip((0.965 - y) / 0.07, 0, 1) ** 1.5, 0.0016) * (z > 0.02) * (y > 0.893) * (y < 0.968)
    fly = _line(x - 0.016 * smoothstep(0.865, 0.90, y), 0.0012) * (z > 0.03) * (y > 0.865)
    middle = _line(x, 0.0014) * (y > 0.80)
    back = np.maximum(np.abs(side - 0.080) / 0.042, np.abs(y - 0.915 + 0.010 * (np.abs(side - 0.08) / 0.042) * (y < 0.915)) / 0.042)
    patch = _line((back - 1.0) * 0.042, 0.0014) * (z < -0.03)
    hem = _line(y - 0.085, 0.0012)
    shade -= 0.34 * np.clip(seam + pocket + fly + middle + patch + hem, 0, 1)
    # Worn lighter over thigh and knee.
    worn = (np.exp(-(((y - 0.52) / 0.10) ** 2)) + 0.7 * np.exp(-(((y - 0.74) / 0.10) ** 2))) * smoothstep(0.2, 0.9, normal[:, 2])
    shade += 0.10 * worn * (0.7 + 0.3 * folds)
    return np.tile(base, (len(p), 1)) * (1.0 + shade)[:, None]


def paint_shoe(r: Recipe, p: F64, normal: F64) -> F64:
    """(N, 3) colours of the shoes' uppers: leather, toe cap, laces."""
    base = np.array(r.colour("shoes"), np.float64)
    side, y, z = np.abs(p[:, 0]) - 0.093, p[:, 1], p[:, 2]
    shade = 0.05 * noise(p / 0.004, 2, r.seed + 51)
    cap = _line(z - 0.148 - 0.25 * side**2 / 0.03, 0.0012)
    heel = _line(z + 0.018 - 0.2 * y, 0.0012) * (y < 0.075)
    tongue = (np.abs(side) < 0.020) * (z > 0.045) * (z < 0.118) * (normal[:, 1] > 0.35)
    edge = _line(np.abs(side) - 0.021, 0.0014) * (z > 0.04) * (z < 0.120) * (normal[:, 1] > 0.2)
    shade -= 0.35 * np.clip(cap + heel + edge, 0, 1) + 0.12 * tongue
    out = np.tile(base, (len(p), 1)) * (1.0 + shade)[:, None]
    lace = smoothstep(0.15, 0.55, np.cos(2 * np.pi * (z + 0.30 * np.abs(side)) / 0.0145)) * tongue
    light = np.array((222.0, 216.0, 204.0)) if 60 < base.mean() < 170 else (0.45 * base + np.array((20.0, 18.0, 16.0)))
    return out * (1 - lace[:, None]) + lace[:, None] * light


def paint_sole(r: Recipe, p: F64, normal: F64) -> F64:
    """(N, 3) colours of the soles."""
    dark = np.array((38.0, 34.0, 32.0)) if np.mean(r.colour("shoes")) < 150 else np.array((214.0, 206.0, 190.0))
    ridge = 0.10 * np.sin(p[:, 2] * 2 * np.pi / 0.012) * (normal[:, 1] < -0.5)
    return np.tile(dark, (len(p), 1)) * (1.0 + ridge - 0.25 * _line(p[:, 1] - 0.0155, 0.0012))[:, None]

"""Blazers: open in front above and below a button, with collar and lapels that fall over; worn over a shirt."""

from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.clothes.build import Build
from vistel.figure.clothes.cloth import Cloth, sewn
from vistel.figure.clothes.collar import along, lapels
from vistel.figure.clothes.cut import Field
from vistel.figure.clothes.fastening import button, middle_line
from vistel.figure.clothes.garment import Worn
from vistel.figure.clothes.sheet import Paint
from vistel.figure.clothes.shell import shell
from vistel.figure.clothes.strip import hem
from vistel.figure.clothes.tops import Cut, above, neckline, painter, sleeves, top_pattern
from vistel.figure.clothes.weave import Floats, Look, Weave
from vistel.geometry.smoothstep import smooth

BLAZER = Cut(0.0105, 0.010, 0.0035, 0.62, 0.022, 0.955, 0.013, 0.12, 0.0, (1.34, 0.010))
_CLOSED = 0.022
"""Height over which the fronts are closed [m]."""


def blazer(name: str, build: Build, cut: Cut, weave: Weave, seed: int) -> Worn:
    """With one button."""
    scale = build.scale
    low = build.crotch + 0.016 * scale
    borders = {
        "neck": neckline(build, *cut.neck),
        "front": _opening(build, low),
        "hem": above(low),
        "cuff": sleeves(build, cut.sleeve),
    }
    pattern = replace(top_pattern(build, cut, borders), waves=24, triangles=1150)
    made = shell(build, pattern)
    rings = sorted((ring for of in made.rims.values() for ring in of), key=lambda ring: -float(made.cloth.points[ring, 1].mean()))
    cloth, more, hems = made.cloth, list[Cloth](), list[Cloth]()
    neck = next(ring for ring in rings if abs(float(cloth.points[ring, 0].mean())) < 0.05)
    more.append(lapels(build, cloth, along(cloth, neck, 0.0, 56, lowest=True), "lapel"))
    for ring in rings:
        # Lapels hide the edge along the neck.
        if ring is not neck:
            cuff = abs(float(cloth.points[ring, 0].mean())) > 0.05
            hems.append(hem(cloth, ring, cut.thick, 0.035, edge=cuff))
    height, at = middle_line(build, made.cloth)
    y = _button(build) - 0.5 * _CLOSED * scale
    place = np.array((0.0, y, float(np.interp(y, height, at[:, 2])) + 0.002))
    closing = button(place, np.array((0.0, 0.0, 1.0)), made.cloth, 0.010)
    look, hides, sinks = _painter(build, weave, seed), pattern.hides(build, 0.05), pattern.sinks(build)
    return Worn(
        name,
        sewn([cloth, *more]),
        hides,
        sinks,
        pattern.inside,
        look,
        (1250, 560),
        hems=tuple(hems),
        details=(closing,),
        both_sides=True,
        hangs=_open_fronts(build),
    )


def _button(build: Build) -> float:
    """Height at which the fronts meet [m]."""
    return build.waist + 0.045 * build.scale


def _opening(build: Build, hem: float) -> Field:
    """Beside a V that comes down from the neck, and beside the fronts that part again below the button."""
    scale, (middle, radius) = build.scale, build.neck
    meet, part = _button(build), _button(build) - _CLOSED * scale
    top = float(build.joint("neck")[1])

    def inside(p: F64) -> F64:
        y = p[:, 1]
        upper = 1.30 * radius * np.clip((y - meet) / (top - meet), 0.0, None) ** 0.92
        lower = 0.060 * scale * np.clip((part - y) / (part - hem), 0.0, None) ** 1.4
        half = np.where(y > meet, upper, np.where(y < part, lower, -0.02))
        return np.where(p[:, 2] > middle[2] - 0.02, np.abs(p[:, 0]) - half, 0.2)

    return inside


def _open_fronts(build: Build) -> Field:
    """The fronts hang free beside their opening below the button, less and less towards the sides, where they lie on the hips."""
    scale, part = build.scale, _button(build) - _CLOSED * build.scale
    middle = build.trunk.origin[2]

    def free(p: F64) -> F64:
        aside = smooth((0.145 * scale - np.abs(p[:, 0])) / (0.075 * scale)) * smooth((p[:, 2] - middle) / (0.05 * scale))
        return np.maximum(0.0, part - p[:, 1]) * aside

    return free


def _painter(build: Build, weave: Weave, seed: int) -> Paint:
    plain = painter(weave, seed)
    low = build.crotch + 0.30 * (build.waist - build.crotch) - float(build.trunk.origin[1])

    def paint(panel: str, u: Floats, v: Floats) -> Look:
        if panel == "button":
            return Look(np.broadcast_to(0.45 * np.array(weave.colour), (*u.shape, 3)), np.zeros_like(u))
        look = plain(panel, u, v)
        if panel == "lapel":
            edge = np.exp(-np.square((v - 0.003) / 0.003))
            return Look(look.colour * (1.04 - 0.38 * edge)[..., None], look.height)
        if panel != "front":
            return look
        # Flaps of the pockets at the hips.
        across, up = np.abs(u) - 0.115 * build.scale, v - low
        flap = np.maximum(np.abs(across) - 0.07 * build.scale, np.abs(up) - 0.024 * build.scale)
        edge = np.exp(-np.square(flap / 0.0025))
        return Look(look.colour * (1.0 - 0.28 * edge)[..., None], look.height + 0.0012 * np.clip(0.5 - flap / 0.003, 0.0, 1.0))

    return paint

"""Trousers and jeans."""

from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.clothes.build import LEG, TRUNK, Build
from vistel.figure.clothes.cloth import Cloth
from vistel.figure.clothes.fastening import buckle, middle_line
from vistel.figure.clothes.garment import Worn
from vistel.figure.clothes.panels import of_legs
from vistel.figure.clothes.shell import Pattern, Tables, of_skin, shell
from vistel.figure.clothes.strip import hem, offsets, with_strip
from vistel.figure.clothes.tailoring import trouser_painter
from vistel.figure.clothes.tops import above, below
from vistel.figure.clothes.tube import Tube, hung
from vistel.figure.clothes.weave import Weave
from vistel.geometry.smoothstep import smooth

LOWER = (*TRUNK, *LEG, "foot")
"""Limbs that trousers may cover."""
_BAND = 0.034
"""Height of a waistband, for a body of usual height [m]."""
_ROWS = 3


@dataclass(frozen=True)
class LegCut:
    """Of trousers. clear, ease, thick [m]; taper: how much nearer a leg comes per metre below the hip; hem: radius of a leg's end,
    for a body of usual height [m]."""

    clear: float = 0.007
    ease: float = 0.006
    thick: float = 0.0022
    taper: float = 0.055
    hem: float = 0.078


def trousers(name: str, build: Build, cut: LegCut, weave: Weave, seed: int, *, belt: bool = False) -> Worn:
    """From the waist to the shoes. belt: whether they have one."""
    scale = build.scale
    band = _BAND * scale
    borders = {"waist": below(build.waist - band), "ankle": above(float(build.joint("left_foot")[1]) + 0.045 * scale)}
    legs = [_leg(tube, cut, scale) for tube in build.legs]
    tables: Tables = (build.trunk.girth + cut.clear + 0.003, None, None, legs[0], legs[1])
    groin, band_low = build.crotch + 0.05 * scale, build.waist - 0.06 * scale

    def soft(p: F64) -> F64:
        return smooth((p[:, 1] - groin + 0.10 * scale) / (0.05 * scale)) * smooth((band_low - p[:, 1]) / (0.05 * scale))

    pattern = Pattern(
        LOWER, borders, lambda p: np.full(len(p), cut.clear), tables, of_legs(build), rounds=14, triangles=1000, soft=soft
    )
    made = shell(build, pattern)
    cloth = made.cloth
    # Legs go on below where they are cut, down to the shoes, and above it as a band.
    seen = {"waist": below(build.waist), "shoe": above(float(build.joint("left_foot")[1]) - 0.02 * scale)}
    whole = replace(pattern, borders=seen)
    hems: list[Cloth] = []
    for rim, rings in made.rims.items():
        for at in rings:
            if rim == "waist":
                cloth, ring = with_strip(cloth, at, offsets(cloth, at, [(0.0018, 0.001), (0.0022, band)]), "waistband")
            else:
                cloth, ring = _to_the_shoe(build, cloth, at)
            hems.append(hem(cloth, ring, cut.thick, 0.02))
    details: tuple[Cloth, ...] = ()
    if belt:
        height, at = middle_line(build, cloth)
        y = build.waist - 0.5 * band
        place = np.array((0.0, y, float(np.interp(y, height, at[:, 2])) + 0.001))
        details = (buckle(place, np.array((0.0, 0.0, 1.0)), cloth, 0.044, 0.036),)
    look = trouser_painter(build, weave, seed, jeans=weave.kind == "denim", belt=belt)
    hides, sinks = whole.hides(build, 0.03), whole.sinks(build)
    return Worn(name, cloth, hides, sinks, whole.inside, look, (1400, 520), hems=tuple(hems), details=details)


def _leg(tube: Tube, cut: LegCut, scale: float) -> F64:
    hull = tube.girth + cut.clear + cut.ease
    even = 0.4 * hull + 0.6 * hull.mean(axis=1, keepdims=True)
    return np.maximum(hung(tube, np.maximum(hull, even), 0.0, cut.taper), cut.hem * scale * (tube.s > np.median(tube.s))[:, None])


def _to_the_shoe(build: Build, cloth: Cloth, ring: I32) -> tuple[Cloth, I32]:
    """Down to the shoe: low behind, on the instep in front, where the cloth breaks a little."""
    p, scale = cloth.points[ring], build.scale
    middle = p.mean(axis=0)
    out = p - middle
    out[:, 1] = 0.0
    far = np.linalg.norm(out, axis=1, keepdims=True)
    front = (out[:, 2:] / far).ravel()
    low = scale * (0.030 + 0.034 * smooth(0.5 * (front + 1.0)))
    rows: list[F64] = []
    for k in range(1, _ROWS + 1):
        t = k / _ROWS
        at = p + 0.006 * scale * np.sin(np.pi * t) * out / far * np.maximum(front, 0.0)[:, None]
        at[:, 1] = p[:, 1] + t * (low - p[:, 1])
        at[:, 2] += 0.010 * scale * t * t * np.maximum(front, 0.0)
        rows.append(at)
    # They continue the panels of the leg: cloth there has places of its own.
    return with_strip(cloth, ring, np.array(rows), "ankle", of_skin(build, np.array(rows), *LEG, "foot"))

"""Shirts: a collar that falls over, a placket with buttons, cuffs; tucked in."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vistel.figure.clothes.build import ARM, Build
from vistel.figure.clothes.cloth import Cloth, sewn
from vistel.figure.clothes.collar import along, shirt_collar
from vistel.figure.clothes.cut import Field
from vistel.figure.clothes.fastening import button, middle_line
from vistel.figure.clothes.garment import Worn
from vistel.figure.clothes.sheet import Paint
from vistel.figure.clothes.shell import of_skin, shell
from vistel.figure.clothes.strip import hem, offsets, with_strip
from vistel.figure.clothes.tops import Cut, above, beyond_wrist, neckline, painter, round_wrists, sleeves, top_pattern
from vistel.figure.clothes.weave import Floats, Look, Weave
from vistel.geometry.smoothstep import smooth

SHIRT = Cut(0.003, 0.0, 0.0018, 0.60, 0.014, 0.985, 0.011, 0.13, 0.70, (1.20, 0.026), tucked=True)
UNDER_JACKET = replace(SHIRT, clear=0.006, loose=0.4, ease=0.008, sleeve_ease=0.004, taper=1.0)
"""A jacket presses it flat."""
_CUFF = 0.060
_BUTTONS = 6
_BUTTON = 0.0055
"""Radius [m]."""
_SHELL = (226.0, 222.0, 210.0)
_PLACKET = 0.016
"""Half its width [m]."""


def shirt(name: str, build: Build, cut: Cut, weave: Weave, seed: int) -> Worn:
    """A shirt."""
    scale = build.scale
    cuff, deep = sleeves(build, cut.sleeve), _CUFF * scale
    borders: dict[str, Field] = {
        "neck": neckline(build, *cut.neck),
        "hem": above(build.waist - 0.030 * scale),
        "cuff": lambda p: cuff(p) - deep,
    }
    pattern = top_pattern(build, cut, borders)
    made = shell(build, pattern)
    cloth, more, hems = made.cloth, list[Cloth](), list[Cloth]()
    for rim, rings in made.rims.items():
        for at in rings:
            ring = at
            if rim == "neck":
                line = along(cloth, at, 0.022 * scale, 28)
                # It hides the rim.
                more.append(shirt_collar(build, line, 0.028 * scale, 0.044 * scale, 0.074 * scale, "collar"))
                continue
            if rim == "cuff":
                tight = beyond_wrist(build, cloth.points[at], 0.009)
                steps = [(0.0012, 0.0), (-0.6 * tight, 0.05 * deep), (-tight, deep)]
                rows = round_wrists(build, offsets(cloth, at, steps), 0.005)
                cloth, ring = with_strip(cloth, at, rows, "cuff", of_skin(build, rows, *ARM, "palm"))
            hems.append(hem(cloth, ring, cut.thick, 0.03))
    buttons = _buttons(build, cloth)
    look = _painter(build, weave, seed, [float(b.points[:, 1].mean()) for b in buttons])
    whole = replace(pattern, borders=borders | {"cuff": cuff})
    hides, sinks = whole.hides(build, 0.018), whole.sinks(build)
    return Worn(
        name,
        sewn([cloth, *more]),
        hides,
        sinks,
        whole.inside,
        look,
        (1250, 560),
        hems=tuple(hems),
        details=tuple(buttons),
        both_sides=True,
    )


def _buttons(build: Build, cloth: Cloth) -> list[Cloth]:
    height, at = middle_line(build, cloth)
    out: list[Cloth] = []
    low, high = build.waist + 0.01, float(height[-1]) - 0.022 * build.scale
    for k in range(_BUTTONS):
        y = low + (high - low) * k / (_BUTTONS - 1)
        z = float(np.interp(y, height, at[:, 2]))
        slope = float(np.interp(y + 0.01, height, at[:, 2]) - z) / 0.01
        face = np.array((0.0, -slope, 1.0))
        out.append(button(np.array((0.0, y, z)) + 0.001 * face, face / np.linalg.norm(face), cloth, _BUTTON))
    return out


def _painter(build: Build, weave: Weave, seed: int, buttons: Sequence[float]) -> Paint:
    plain = painter(weave, seed)

    def paint(panel: str, u: Floats, v: Floats) -> Look:
        if panel == "button":
            return Look(np.broadcast_to(np.array(_SHELL, np.float32), (*u.shape, 3)), np.zeros_like(u))
        look = plain(panel, u, v)
        if panel == "front":
            band = smooth((_PLACKET - np.abs(u)) / 0.002 + 0.5)
            edge = np.exp(-np.square((np.abs(u) - _PLACKET) / 0.0022))
            # Where a button is, it is seen from afar, too.
            low = v + build.trunk.origin[1]
            near = np.min([np.hypot(u, low - y) for y in buttons], axis=0)
            there = np.clip((_BUTTON - near) / 0.0025 + 0.5, 0.0, 1.0)[..., None]
            colour = look.colour * (1.0 - 0.16 * edge)[..., None]
            return Look(colour + there * (np.array(_SHELL, np.float32) - colour), look.height + 0.0016 * band)
        if panel in ("cuff", "collar"):
            return Look(look.colour * (1.0 - 0.05 * np.cos(2.0 * np.pi * v / 0.4))[..., None], look.height)
        return look

    return paint

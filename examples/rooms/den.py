"""Writes den.usdz: a room of our own with floor, walls, a square table, two chairs, a rug and things to take.

python examples/rooms/den.py examples/rooms/den.usdz
"""

import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vistel.figure.making.source import SourceMaterial
from vistel.geometry.rotation import quaternion_from_matrix, rotation_x, rotation_y
from vistel.space.files import Interior, Polymesh, save_usd
from vistel.space.room import Room, Seat
from vistel.space.things.things import GraspAxis, Look, PhysicsMaterial, Thing, ThingPrimitive

WIDE, DEEP, HIGH = 2.6, 2.2, 2.6
"""Half the room's width and depth, and its height [m]."""
TABLE, SEAT = 0.72, 0.43
"""Heights of the table and of a chair's seat [m]."""
UNSEEN = 0x80808000
"""Colour of what is felt and drawn as a polymesh."""
UPRIGHT = quaternion_from_matrix(rotation_x(-math.pi / 2.0))
"""Turns a primitive's Z upwards."""


def planks(size: int = 512) -> NDArray[np.uint8]:
    """(size, size, 3) boards of pine."""
    rng = np.random.default_rng(5)
    v, u = np.mgrid[0:size, 0:size] / size
    board = np.floor(8.0 * v).astype(int)
    tone = 0.85 + 0.25 * rng.random(8)[board % 8]
    grain = 0.05 * np.sin(2.0 * math.pi * (40.0 * v + 1.5 * np.sin(6.0 * u + 3.0 * board)))
    joint = np.where((8.0 * v) % 1.0 < 0.03, 0.6, 1.0)
    colour = np.array((196.0, 158.0, 112.0)) * ((tone + grain) * joint)[..., None]
    return np.clip(colour, 0, 255).astype(np.uint8)


def stripes(size: int = 256) -> NDArray[np.uint8]:
    """(size, size, 3) a woven rug."""
    v, u = np.mgrid[0:size, 0:size] / size
    band = np.floor(9.0 * v).astype(int) % 3
    colours = np.array(((150, 60, 52), (214, 196, 160), (58, 84, 104)), np.float64)
    weave = 0.92 + 0.08 * np.sign(np.sin(160.0 * u) * np.sin(160.0 * v))
    return np.clip(colours[band] * weave[..., None], 0, 255).astype(np.uint8)


def sheet(corners: list[tuple[float, float, float]], material: SourceMaterial, repeat: tuple[float, float]) -> Polymesh:
    """A rectangle, its corners counter-clockwise from outside, its picture repeated so often across and up."""
    triangles = np.array(((0, 1, 2), (0, 2, 3)), np.int32)
    uv = np.array(((0, 0), (repeat[0], 0), repeat, (0, repeat[1])), np.float32)
    return Polymesh(np.array(corners, np.float32), triangles, uv, triangles, np.zeros(2, np.int32), (material,))


def box(half: tuple[float, float, float], at: tuple[float, float, float], colour: int = 0) -> ThingPrimitive:
    """A box with slightly rounded edges."""
    return ThingPrimitive("superellipsoid", (*half, 0.1, 0.1), np.array(at), colour=colour)


def shell() -> tuple[list[Thing], list[Polymesh]]:
    """Floor, three walls (the fourth is open to who looks in), and a rug."""
    boards, plaster = SourceMaterial("boards", (196, 158, 112), planks()), SourceMaterial("plaster", (226, 220, 206))
    w, d, h = WIDE, DEEP, HIGH
    floor = sheet([(-w, 0, d), (w, 0, d), (w, 0, -d), (-w, 0, -d)], boards, (3, 3))
    rug = sheet(
        [(-1.2, 0, 1.0), (1.2, 0, 1.0), (1.2, 0, -1.0), (-1.2, 0, -1.0)], SourceMaterial("rug", (150, 90, 80), stripes()), (1, 1)
    )
    walls = (
        ("wall-back", [(-w, 0, -d), (w, 0, -d), (w, h, -d), (-w, h, -d)], box((w, h / 2, 0.05), (0, h / 2, -d - 0.05), UNSEEN)),
        ("wall-left", [(-w, 0, d), (-w, 0, -d), (-w, h, -d), (-w, h, d)], box((0.05, h / 2, d), (-w - 0.05, h / 2, 0), UNSEEN)),
        ("wall-right", [(w, 0, -d), (w, 0, d), (w, h, d), (w, h, -d)], box((0.05, h / 2, d), (w + 0.05, h / 2, 0), UNSEEN)),
    )
    things = [
        Thing("floor", "floor", "floor", (), 0.0, 0.0, 0xC49E70FF, np.zeros(3), looks=(Look(floor.digest),)),
        Thing("rug", "rug", "rug", (), 0.0, 0.0, 0x965A50FF, np.array((0.0, 0.004, 0.0)), looks=(Look(rug.digest),)),
    ]
    models = [floor, rug]
    for name, corners, body in walls:
        model = sheet(corners, plaster, (1, 1))
        models.append(model)
        things.append(Thing(name, name, "wall", (body,), 0.0, 0.0, 0xE2DCCEFF, np.zeros(3), looks=(Look(model.digest),)))
    return things, models


def table() -> Thing:
    legs = tuple(box((0.03, 0.34, 0.03), (x, 0.34, z)) for x in (-0.55, 0.55) for z in (-0.33, 0.33))
    parts = (box((0.62, 0.02, 0.40), (0, TABLE - 0.02, 0)), *legs)
    return Thing("table", "square table", "table", parts, 0.0, 0.0, 0x7A5230FF, np.zeros(3))


def chair(number: int, seat: Seat) -> Thing:
    """A chair in its seat's frame: who sits faces +Z."""
    legs = tuple(box((0.018, 0.2, 0.018), (x, 0.2, z)) for x in (-0.18, 0.18) for z in (-0.17, 0.17))
    parts = (box((0.21, 0.02, 0.20), (0, SEAT - 0.02, 0)), box((0.20, 0.20, 0.015), (0, 0.74, -0.20)), *legs)
    rotation = quaternion_from_matrix(rotation_y(seat.heading))
    return Thing(f"chair-{number}", f"chair {number + 1}", "chair", parts, 0.0, 0.1, 0x3E5C50FF, seat.position, rotation)


def loose() -> list[Thing]:
    """A baton to hand over, a box, a ball of clay and a bottle."""
    baton = ThingPrimitive("cone_sphere", (-0.09, 0.0, 0.0, 0.09, 0.0, 0.0, 0.013, 0.013))
    bottle = (
        ThingPrimitive("superellipsoid", (0.035, 0.035, 0.085, 0.2, 1.0), np.array((0.0, -0.02, 0.0)), UPRIGHT),
        ThingPrimitive("cone_sphere", (0.0, 0.06, 0.0, 0.0, 0.12, 0.0, 0.016, 0.012)),
    )
    return [
        Thing(
            "baton",
            "red baton",
            "baton",
            (baton,),
            0.09,
            0.05,
            0xC23B32FF,
            np.array((0.0, TABLE + 0.013, 0.1)),
            axes=(GraspAxis(np.zeros(3), np.array((1.0, 0.0, 0.0)), 0.013),),
        ),
        Thing(
            "parcel",
            "brown parcel",
            "box",
            (box((0.06, 0.04, 0.045), (0, 0, 0)),),
            0.4,
            0.0,
            0xA57C4BFF,
            np.array((-0.3, TABLE + 0.04, 0.05)),
        ),
        Thing(
            "clay",
            "clay",
            "ball",
            (ThingPrimitive("sphere", (0.04,)),),
            0.35,
            0.7,
            0xB5A48FFF,
            np.array((0.25, TABLE + 0.04, -0.1)),
            material=PhysicsMaterial("plastic"),
        ),
        Thing("bottle", "green bottle", "bottle", bottle, 0.5, 0.0, 0x3F7A4AFF, np.array((0.4, TABLE + 0.105, 0.15))),
    ]


def den() -> Interior:
    """The room."""
    seats = (Seat(np.array((0.0, 0.0, -0.72)), 0.0), Seat(np.array((0.0, 0.0, 0.72)), math.pi))
    things, models = shell()
    things += [table(), *(chair(n, s) for n, s in enumerate(seats)), *loose()]
    return Interior(Room(seats, (), shell=False)).with_things(tuple(things), {m.digest: m for m in models})


if __name__ == "__main__":
    save_usd(den(), Path(sys.argv[1] if len(sys.argv) > 1 else "den.usdz"))

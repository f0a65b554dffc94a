"""Writes workshop.usdz: a bench with things on joints. A chest with a lid, a cabinet with a drawer and a door, a tin that can be
carried, a button and a lamp.

python examples/rooms/workshop.py examples/rooms/workshop.usdz
"""

import math
import sys
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import quaternion_from_matrix, rotation_x, rotation_y, rotation_z
from vistel.space.files import Interior, save_usd
from vistel.space.joints.joint import Button, Detent, Drive, Joint, JointFrame, JointKind
from vistel.space.room import Room, Seat
from vistel.space.things.things import GraspAxis, Thing, ThingPrimitive

BENCH = 0.72
"""Height of the bench [m]."""
SEAT = 0.43
"""Height of a stool [m]."""
CHEST = np.array((-0.19, BENCH + 0.05, -0.04))
"""Middle of the chest [m]."""
CABINET = np.array((0.22, BENCH + 0.12, 0.0))
"""Middle of the cabinet [m]."""
PANEL = np.array((0.0, BENCH + 0.015, -0.21))
"""Middle of the box with the button [m]."""
TIN = np.array((-0.40, BENCH + 0.03, 0.20))
"""Middle of the tin [m]."""
UPRIGHT = quaternion_from_matrix(rotation_x(-0.5 * math.pi))
"""Turns a primitive's Z upwards."""
WOOD, DARK, METAL = 0xA9804FFF, 0x6E4A2CFF, 0x8E9499FF


def beside(place: F64, x: float, y: float, z: float) -> F64:
    """(3,) so far from a place [m]."""
    return place + np.array((x, y, z))


def box(half: tuple[float, float, float], at: tuple[float, float, float], colour: int = 0) -> ThingPrimitive:
    """A box with slightly rounded edges."""
    return ThingPrimitive("superellipsoid", (*half, 0.1, 0.1), np.array(at), colour=colour)


def plate(half: tuple[float, float, float], at: tuple[float, float, float], colour: int = 0) -> ThingPrimitive:
    """A flat box with round edges. Its distance from things beside it is exact, as a flat superellipsoid's is not."""
    thin = int(np.argmin(half))
    a, b = (axis for axis in range(3) if axis != thin)
    corners: list[float] = []
    for s, t in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)):
        corner = np.zeros(3)
        corner[a], corner[b] = s * (half[a] - half[thin]), t * (half[b] - half[thin])
        corners += corner.tolist()
    return ThingPrimitive("rounded_polygon", (half[thin], *corners), np.array(at), colour=colour)


def bar(a: tuple[float, float, float], b: tuple[float, float, float], radius: float, colour: int = METAL) -> ThingPrimitive:
    """A round bar between two points."""
    return ThingPrimitive("cone_sphere", (*a, *b, radius, radius), colour=colour)


def handle(wide: float, foot: F64, out: F64) -> tuple[tuple[ThingPrimitive, ...], GraspAxis]:
    """A bar across X, `wide` to both sides of `foot` + `out`, on two posts."""
    end, radius = foot + out, 0.010
    sides = [np.array((s * wide, 0.0, 0.0)) for s in (-1.0, 1.0)]
    posts = tuple(bar(tuple(foot + s), tuple(end + s), 0.006) for s in sides)
    across = bar(tuple(end + sides[0]), tuple(end + sides[1]), radius)
    return (across, *posts), GraspAxis(end, np.array((1.0, 0.0, 0.0)), radius)


def open_box(half: tuple[float, float, float], wall: float) -> tuple[ThingPrimitive, ...]:
    """A box without its top: bottom and four walls, `wall` to both sides of their middles."""
    x, y, z = half
    return (
        plate((x, wall, z), (0.0, wall - y, 0.0)),
        *(plate((wall, y, z), (s * (x - wall), 0.0, 0.0)) for s in (-1.0, 1.0)),
        *(plate((x, y, wall), (0.0, 0.0, s * (z - wall))) for s in (-1.0, 1.0)),
    )


def hinge(axis: F64, at: F64, thing: F64, base: F64) -> tuple[JointFrame, JointFrame]:
    """Frames of a joint at the point `at` of the room, for a base and a thing that stand straight at `base` and `thing`.

    axis (3, 3): turns X to where the joint's axis is.
    """
    turn = quaternion_from_matrix(axis)
    return JointFrame(at - base, turn), JointFrame(at - thing, turn)


def furniture(seats: tuple[Seat, ...]) -> list[Thing]:
    """Bench and stools."""
    legs = tuple(box((0.035, 0.34, 0.035), (x, 0.34, z)) for x in (-0.58, 0.58) for z in (-0.33, 0.33))
    top = box((0.65, 0.02, 0.40), (0.0, BENCH - 0.02, 0.0))
    out = [Thing("bench", "work bench", "table", (top, *legs), 0.0, 0.0, DARK, np.zeros(3))]
    for n, seat in enumerate(seats):
        stool = (
            ThingPrimitive("superellipsoid", (0.19, 0.19, 0.02, 0.3, 1.0), np.array((0.0, SEAT - 0.02, 0.0)), UPRIGHT),
            *(bar((x * 0.10, SEAT - 0.04, z * 0.10), (x * 0.15, 0.012, z * 0.15), 0.013) for x in (-1, 1) for z in (-1, 1)),
        )
        rotation = quaternion_from_matrix(rotation_y(seat.heading))
        out.append(Thing(f"stool-{n}", f"stool {n + 1}", "chair", stool, 0.0, 0.1, 0x3E5C50FF, seat.position, rotation))
    return out


def chest() -> tuple[list[Thing], list[Joint]]:
    """A chest that is screwed to the bench, with a lid on a stiff hinge on its far side: it stays where it is left."""
    lid_at = beside(CHEST, 0.0, 0.05 + 0.008, 0.0)
    grip, axis = handle(0.06, np.array((0.0, 0.008, -0.078)), np.array((0.0, 0.052, 0.0)))
    lid = (plate((0.135, 0.008, 0.105), (0.0, 0.0, 0.0)), *grip)
    things = [
        Thing("chest", "box", "box", open_box((0.13, 0.05, 0.10), 0.006), 0.0, 0.0, WOOD, CHEST),
        Thing("chest-lid", "lid", "lid", lid, 0.6, 0.0, 0xB98E5CFF, lid_at, axes=(axis,)),
    ]
    frames = hinge(np.eye(3), beside(CHEST, 0.0, 0.05, 0.10), lid_at, CHEST)
    limits = 0.0, math.radians(105.0)
    brake = Drive(damping=500.0, most=0.7)
    return things, [Joint("chest-hinge", JointKind.HINGE, "chest-lid", "chest", *frames, *limits, brake)]


def cabinet() -> tuple[list[Thing], list[Joint]]:
    """A cabinet on the bench: above a flat drawer that clicks shut, its handle over its front; below it a door."""
    x, y, z, wall = 0.16, 0.12, 0.12, 0.006
    body = (
        *(plate((x, wall, z), (0.0, h, 0.0)) for h in (wall - y, 0.0, y - wall)),
        *(plate((wall, y, z), (s * (x - wall), 0.0, 0.0)) for s in (-1.0, 1.0)),
        plate((x, y, wall), (0.0, 0.0, z - wall)),
    )
    drawer_at = beside(CABINET, 0.0, 0.04, -0.015)
    grip, axis = handle(0.055, np.array((0.0, 0.025, -0.112)), np.array((0.0, 0.052, -0.050)))
    drawer = (*open_box((0.14, 0.026, 0.095), 0.005), plate((0.146, 0.030, 0.006), (0.0, 0.0, -0.107)), *grip)
    door_at = beside(CABINET, 0.0, -0.06, -0.128)
    panel = (
        plate((0.146, 0.050, 0.006), (0.0, 0.0, 0.0)),
        ThingPrimitive("sphere", (0.014,), np.array((-0.115, 0.0, -0.026)), colour=METAL),
    )
    things = [
        Thing("cabinet", "cabinet", "cabinet", body, 0.0, 0.0, WOOD, CABINET),
        Thing("drawer", "drawer", "drawer", drawer, 0.9, 0.0, 0xB98E5CFF, drawer_at, axes=(axis,)),
        Thing("door", "door", "door", panel, 0.5, 0.0, 0xB98E5CFF, door_at),
    ]
    towards_seat = rotation_y(0.5 * math.pi)
    down = rotation_z(-0.5 * math.pi)
    slide = hinge(towards_seat, drawer_at, drawer_at, CABINET)
    swing = hinge(down, beside(door_at, 0.146, 0.0, 0.0), door_at, CABINET)
    return things, [
        Joint(
            "drawer-slide",
            JointKind.SLIDER,
            "drawer",
            "cabinet",
            *slide,
            0.0,
            0.17,
            Drive(damping=2000.0, most=2.0),
            (Detent(0.0, 0.012, 4.0),),
        ),
        Joint(
            "door-hinge",
            JointKind.HINGE,
            "door",
            "cabinet",
            *swing,
            0.0,
            math.radians(110.0),
            Drive(damping=100.0, most=0.03),
            (Detent(0.0, math.radians(5.0), 0.15),),
        ),
    ]


def button() -> tuple[list[Thing], list[Joint]]:
    """A button on a spring, and the lamp that it switches."""
    cap_at = beside(PANEL, 0.0, 0.027, 0.0)
    cap = ThingPrimitive("superellipsoid", (0.022, 0.022, 0.012, 0.3, 1.0), rotation=UPRIGHT)
    lamp_at = np.array((-0.42, BENCH + 0.16, -0.02))
    stand = (
        bar((0.0, -0.03, 0.0), (0.0, -0.15, 0.0), 0.008),
        ThingPrimitive("superellipsoid", (0.05, 0.05, 0.008, 0.3, 1.0), np.array((0.0, -0.152, 0.0)), UPRIGHT, METAL),
    )
    things = [
        Thing("panel", "switch box", "panel", (box((0.05, 0.015, 0.04), (0, 0, 0)),), 0.0, 0.0, 0x4A5560FF, PANEL),
        Thing("button", "button", "button", (cap,), 0.03, 0.0, 0xC23B32FF, cap_at),
        Thing("lamp", "lamp", "lamp", (ThingPrimitive("sphere", (0.035,)),), 0.0, 0.0, 0x777568FF, lamp_at),
        Thing("lamp-stand", "stand of the lamp", "stand", stand, 0.0, 0.0, METAL, lamp_at),
    ]
    frames = hinge(rotation_z(0.5 * math.pi), cap_at, cap_at, PANEL)
    spring = Drive(stiffness=300.0, damping=1.5, target=0.004)
    pressed = Button(-0.006, -0.004, "lamp")
    return things, [Joint("switch", JointKind.SLIDER, "button", "panel", *frames, -0.010, 0.0, spring, button=pressed)]


def tin() -> tuple[list[Thing], list[Joint]]:
    """A tin that can be carried about; a spring closes its lid."""
    lid_at = beside(TIN, 0.0, 0.03 + 0.005, 0.0)
    things = [
        Thing("tin", "tin", "can", open_box((0.05, 0.03, 0.04), 0.004), 0.25, 0.0, 0x2F6DB5FF, TIN),
        Thing("tin-lid", "lid of the tin", "cover", (plate((0.052, 0.005, 0.042), (0, 0, 0)),), 0.06, 0.0, 0x4A86C8FF, lid_at),
    ]
    frames = hinge(np.eye(3), beside(TIN, 0.0, 0.03, 0.04), lid_at, TIN)
    spring = Drive(stiffness=0.03, damping=0.004, target=0.0)
    return things, [Joint("tin-hinge", JointKind.HINGE, "tin-lid", "tin", *frames, 0.0, math.radians(120.0), spring)]


def loose() -> list[Thing]:
    """What lies in the drawer and on the bench."""
    pencil = bar((-0.08, 0.0, 0.0), (0.08, 0.0, 0.0), 0.006, 0xE8B923FF)
    ball_at = beside(CABINET, 0.05, 0.04 - 0.026 + 0.010 + 0.018, -0.01)
    return [
        Thing("marble", "green ball", "ball", (ThingPrimitive("sphere", (0.018,)),), 0.05, 0.0, 0x3F9C5AFF, ball_at),
        Thing("pencil", "yellow bar", "bar", (pencil,), 0.02, 0.0, 0xE8B923FF, np.array((-0.45, BENCH + 0.006, -0.2))),
    ]


def workshop() -> Interior:
    """The room."""
    seats = (Seat(np.array((0.0, 0.0, -0.72)), 0.0), Seat(np.array((0.0, 0.0, 0.72)), math.pi))
    parts = [chest(), cabinet(), button(), tin()]
    things = [*furniture(seats), *(t for some, _ in parts for t in some), *loose()]
    joints = tuple(j for _, some in parts for j in some)
    return Interior(Room(seats, tuple(things), joints=joints))


if __name__ == "__main__":
    save_usd(workshop(), Path(sys.argv[1] if len(sys.argv) > 1 else "workshop.usdz"))

"""Draws figures-touching.png: two people hold hands, arms lie on a table, a hand is on a face, legs are crossed.

    python -m docs.pictures.touching.figures_touching [--out FILE] [AVATAR]

AVATAR: what follows "builtin:", or an avatar file; of everybody in the picture. Needs an OpenGL context (software is fine).
"""

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from docs.pictures.drawing.implicit_render import label
from docs.pictures.drawing.mesh_render import Part, Studio
from vistel.arrays import F64
from vistel.figure.arm_clearance import clear_of_body
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.figure import Figure, FigureState
from vistel.figure.formats.load import load_any
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.hands import FLAT, RELAXED, finger_posture, hand_rotation
from vistel.figure.posture.posture import Posture, Stance, pose_joints, standing
from vistel.figure.posture.reach import reach
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import rotation_x, rotation_y, rotation_z, rotvec_from_matrix
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of

Shot = tuple[str, list[Part], tuple[float, float, float], tuple[float, float, float], float]

TABLE_TOP, TABLE_THICK = 0.74, 0.03
WOOD = (0.74, 0.58, 0.42)
CLASPED = finger_posture((20, 20, 20, 25), (52, 46, 25))
CUPPED = finger_posture((0, 45, 0, 5), (4, 8, 5), 2.0, 1.0)
SIZE = (300, 270)


def seated(avatar: Avatar) -> Posture:
    base = standard_postures()["sitting"]
    return Posture(base.dofs, np.tile(RELAXED, (2, 1)))


def at(figure: Figure, posture: Posture, joint: str) -> F64:
    return pose_joints(figure.avatar.skeleton, posture).position[JOINT_INDEX[joint]]


def dressed(figure: Figure, state: FigureState) -> list[Part]:
    parts = [Part.worn(figure.avatar, figure.avatar.mesh, state.vertices.copy(), state.normals.copy())]
    balls = zip(figure.avatar.eyeballs, state.eyeballs, strict=False)
    return parts + [Part.worn(figure.avatar, m, v, n) for m, (v, n) in balls]


def holding_hands(avatar: Avatar) -> list[Shot]:
    """Two people side by side, a left hand in a right one."""
    left, right = Figure(avatar), Figure(avatar)
    scale = avatar.skeleton.height / 1.75
    apart = 0.74 * scale
    grip = np.array((0.5 * apart, 0.80 * scale, 0.12 * scale))
    hands = np.stack([CLASPED, CLASPED])
    a, b = (Posture(standing().dofs, hands, Stance(np.array((x, 0.0, 0.0)))) for x in (0.0, apart))
    # Palm on palm, crossed, so that either's fingers close round the other's edge.
    for_a, for_b = (np.array((0.0, -math.cos(t), math.sin(t))) for t in (math.radians(62), math.radians(-14)))
    half = np.array((0.027 * scale, 0.0, 0.0))
    a = reach(
        avatar.skeleton,
        a,
        "left",
        grip - half - 0.072 * scale * for_a,
        hand_rotation(1.0, for_a, np.array((1.0, 0.0, 0.0))),
        np.array((0.3, 0.0, -1.0)),
    )
    b = reach(
        avatar.skeleton,
        b,
        "right",
        grip + half - 0.072 * scale * for_b,
        hand_rotation(-1.0, for_b, np.array((-1.0, 0.0, 0.0))),
        np.array((-0.3, 0.0, -1.0)),
    )
    first, second = left.pose(a).posed, right.pose(b).posed
    parts = dressed(left, left.pose(a, [right.ghosts(second)])) + dressed(right, right.pose(b, [left.ghosts(first)]))
    x, y, z = grip.tolist()
    return [
        ("holding hands", parts, (x + 0.5, y + 0.8, 3.4 * scale), (x, 0.95 * scale, 0.0), 0.60),
        ("from the front", parts, (x + 0.10, y + 0.10, z + 0.8), (x, y, z), 0.42),
        ("from behind", parts, (x - 0.15, y + 0.25, z - 0.8), (x, y, z), 0.42),
    ]


def table(front: float) -> tuple[GhostSource, Part]:
    """A table top whose edge is at z = `front`, as a ghost and as it is drawn."""
    r, half, deep = 0.5 * TABLE_THICK, 0.62, 0.6
    y = TABLE_TOP - r
    corners = np.array(((-half, y, front + r), (-half, y, front + deep), (half, y, front + deep), (half, y, front + r)))
    shape = PrimitiveSet.of_kinds(["rounded_polygon"], [[r, *corners.reshape(-1)]], np.eye(3)[None], np.zeros((1, 3)))
    low, high = np.subtract(corners.min(axis=0), (0, r, r)), np.add(corners.max(axis=0), (0, r, 0))
    box = np.array([[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    vertices = np.concatenate([box[list(q)] for q in quads])
    faces = np.array([(4 * n + i, 4 * n + j, 4 * n + k) for n in range(6) for i, j, k in ((0, 1, 2), (0, 2, 3))])
    return ghosts_of(shape), Part.plain(vertices, faces, WOOD)


def arms_on_table(avatar: Avatar) -> list[Shot]:
    figure, scale = Figure(avatar), avatar.skeleton.height / 1.75
    base = standard_postures()["table"]
    posture = Posture(base.dofs, np.tile(FLAT, (2, 1)))
    chest = at(figure, posture, "spine_7")
    front = float(chest[2]) + 0.13 * scale
    ghost, top = table(front)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        wrist = np.array((0.13 * sign * scale, TABLE_TOP + 0.026 * scale, front + 0.25 * scale))
        fingers = np.array((-0.45 * sign, 0.02, 1.0))
        hand = hand_rotation(sign, fingers, np.array((0.0, -1.0, 0.0)))
        posture = reach(avatar.skeleton, posture, side, wrist, hand, np.array((1.2 * sign, -0.55, -0.2)))
    parts = [*dressed(figure, figure.pose(posture, [ghost])), top]
    centre = (0.0, TABLE_TOP + 0.05, front + 0.15)
    return [
        ("arms on a table", parts, (0.9, 1.75, front + 2.2), (0.0, 0.86, front - 0.1), 0.52),
        ("from the side", parts, (1.15, TABLE_TOP + 0.12, front + 0.45), (0.1, TABLE_TOP, front + 0.12), 0.42),
        ("from above", parts, (0.0, TABLE_TOP + 1.2, front + 0.75), centre, 0.50),
    ]


def hand_on_face(avatar: Avatar) -> list[Shot]:
    figure, scale = Figure(avatar), avatar.skeleton.height / 1.75
    posture = replace(seated(avatar), hands=np.stack([RELAXED, CUPPED]))
    head = at(figure, posture, "head")
    hand = hand_rotation(-1.0, np.array((0.16, 1.0, -0.22)), np.array((1.0, -0.1, -0.45)))
    wrist = head + np.array((-0.085, -0.070, 0.080)) * scale
    posture = reach(avatar.skeleton, posture, "right", wrist, hand, np.array((-0.6, -1.0, 0.4)))
    posture = clear_of_body(avatar.skeleton, avatar.body, posture, 0.008)
    parts = dressed(figure, figure.pose(posture))
    x, y, z = np.add(at(figure, posture, "head"), (0.0, 0.04, 0.03)).tolist()
    return [
        ("a hand on a face", parts, (x - 0.25, y + 0.05, z + 1.5), (x, y - 0.14, z), 0.46),
        ("from the right", parts, (x - 0.85, y - 0.02, z + 0.35), (x, y, z), 0.38),
        ("from the front", parts, (x + 0.12, y - 0.02, z + 0.9), (x, y, z), 0.36),
    ]


def legs_crossed(avatar: Avatar) -> list[Shot]:
    """The left thigh on the right one."""
    figure = Figure(avatar)
    base = seated(avatar)
    thigh = rotation_y(math.radians(-21)) @ rotation_x(math.radians(-88 - 21)) @ rotation_y(math.radians(8))
    turns = {
        "left_upper_leg": thigh,
        "left_lower_leg": rotation_z(math.radians(-3)) @ rotation_x(math.radians(84)),
        "left_foot": rotation_x(math.radians(28)),
        "right_upper_leg": rotation_y(math.radians(-7)) @ rotation_x(math.radians(-88)),
    }
    posture = replace(base, joints={name: rotvec_from_matrix(np.ascontiguousarray(m)) for name, m in turns.items()})
    parts = dressed(figure, figure.pose(clear_of_body(avatar.skeleton, avatar.body, posture, 0.006)))
    x, y, z = np.add(at(figure, posture, "left_upper_leg"), (-0.05, 0.05, 0.25)).tolist()
    return [
        ("legs crossed", parts, (x + 1.1, y + 0.55, z + 2.0), (x, y + 0.12, z - 0.1), 0.70),
        ("from the front", parts, (x - 0.1, y + 0.15, z + 1.5), (x, y, z), 0.50),
        ("from the right", parts, (x - 1.3, y + 0.25, z + 0.7), (x, y, z), 0.50),
    ]


SCENES: tuple[Callable[[Avatar], list[Shot]], ...] = (holding_hands, arms_on_table, hand_on_face, legs_crossed)


def sheet(avatar: Avatar, scenes: Sequence[Callable[[Avatar], list[Shot]]] = SCENES) -> Image.Image:
    """A row for each scene, seen from three places."""
    studio = Studio()
    rows = [
        [label(studio.photograph(parts, eye, to, SIZE, angle), text) for text, parts, eye, to, angle in scene(avatar)]
        for scene in scenes
    ]
    high = rows[0][0].height
    out = Image.new("RGB", (SIZE[0] * len(rows[0]), high * len(rows)), "white")
    for j, row in enumerate(rows):
        for i, image in enumerate(row):
            out.paste(image, (i * SIZE[0], j * high))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("person", nargs="?", default="person=erik")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "figures-touching.png")
    arguments = parser.parse_args()
    person = arguments.person
    avatar = load_any(Path(person)) if Path(person).is_file() else builtin_avatar(f"builtin:{person}", name=person, height=1.75)
    sheet(avatar).save(arguments.out, optimize=True)


if __name__ == "__main__":
    main()

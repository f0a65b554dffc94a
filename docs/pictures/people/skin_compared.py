"""Draws skin-compared.png: one skin moved by linear blends, by dual quaternions and by a figure.

    python -m docs.pictures.people.skin_compared [--out FILE] [AVATAR]

AVATAR: what follows "builtin:", or an avatar file. Needs an OpenGL context (software is fine).
"""

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from docs.pictures.drawing.implicit_render import label
from docs.pictures.drawing.mesh_render import Part, Studio, normals
from vistel.arrays import F32
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.figure import Figure, vertex_normals
from vistel.figure.formats.load import load_any
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import ELBOW, KNEE, WRIST, Posture, pose_joints
from vistel.figure.posture.standard import standard_postures
from vistel.figure.rigid.component import RigidSkin
from vistel.figure.skeleton import JOINT_INDEX

SIZE = (290, 240)


def turned(**degrees: float) -> Posture:
    """A T-pose with joints of both sides turned."""
    dofs = np.zeros(25)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[ELBOW[side]] = math.radians(degrees.get("elbow", 0.0))
        dofs[WRIST[side]] = (sign * math.radians(degrees.get("twist", 0.0)), 0.0, 0.0)
    dofs[KNEE] = math.radians(degrees.get("knee", 0.0))
    return Posture(dofs)


CASES = {
    "elbow at 150°": (turned(elbow=150), "left_lower_arm", (-0.05, 0.0, 0.05), (0.25, 1.0, 0.35), 0.85),
    "forearm at 180°": (turned(twist=179), "left_lower_arm", (0.13, 0.0, 0.0), (0.1, 0.35, 1.0), 0.80),
    "arm overhead": (standard_postures()["overhead"], "left_upper_arm", (0.02, -0.02, 0.0), (0.6, 0.15, 1.0), 1.15),
    "knee at 120°": (turned(knee=120), "left_lower_leg", (0.0, 0.0, -0.02), (1.0, 0.15, 0.25), 1.35),
}


def by_linear_blends(figure: Figure, posture: Posture) -> F32:
    matrix = figure.skin.matrices(pose_joints(figure.avatar.skeleton, posture)).astype(float).reshape(-1, 3, 4)
    follows, rest = figure.skin.influences, figure.avatar.mesh.vertices.astype(float)
    blend = np.einsum("vk,vkij->vij", follows.weight, matrix[follows.bone])
    return (np.einsum("vij,vj->vi", blend[:, :, :3], rest) + blend[:, :, 3]).astype(np.float32)


def by_dual_quaternions(figure: Figure, posture: Posture) -> F32:
    avatar = figure.avatar
    skin = RigidSkin(
        avatar.skeleton,
        avatar.mesh.vertices,
        vertex_normals(avatar.mesh),
        avatar.mesh.triangles,
        avatar.body.joint[avatar.mesh.limb],
        figure.skin.influences,
    )
    out, turned_normals = np.empty_like(avatar.mesh.vertices), np.empty_like(avatar.mesh.vertices)
    skin.pose(pose_joints(avatar.skeleton, posture), out, turned_normals)
    return out


METHODS: dict[str, Callable[[Figure, Posture], F32]] = {
    "linear blends": by_linear_blends,
    "dual quaternions": by_dual_quaternions,
    "figure": lambda figure, posture: figure.pose(posture).vertices,
}


def sheet(avatar: Avatar) -> Image.Image:
    """A row for each way to move the skin, a column for each posture."""
    studio, figure, images = Studio(), Figure(avatar), []
    for method, move in METHODS.items():
        for case, (posture, joint, off, way, away) in CASES.items():
            middle = pose_joints(avatar.skeleton, posture).position[JOINT_INDEX[joint]] + np.array(off)
            eye = middle + away * np.array(way) / np.linalg.norm(way)
            skin = move(figure, posture)
            part = Part.worn(avatar, avatar.mesh, skin, normals(skin, avatar.mesh.triangles))
            images.append(label(studio.photograph([part], eye.tolist(), middle.tolist(), SIZE, 0.5), f"{case}: {method}"))
    high, columns = images[0].height, len(CASES)
    out = Image.new("RGB", (SIZE[0] * columns, high * len(METHODS)), "white")
    for k, image in enumerate(images):
        out.paste(image, ((k % columns) * SIZE[0], (k // columns) * high))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("person", nargs="?", default="person=carla")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "skin-compared.png")
    arguments = parser.parse_args()
    person = arguments.person
    avatar = load_any(Path(person)) if Path(person).is_file() else builtin_avatar(f"builtin:{person}", name=person, height=1.75)
    sheet(avatar).save(arguments.out, optimize=True)


if __name__ == "__main__":
    main()

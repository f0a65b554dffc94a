"""Draws grasps.png: a recorded hand closed on nothing, and laid on what it holds.

    python -m docs.pictures.touching.grasps [--out FILE] [--recordings FOLDER]

FOLDER: of the recordings, with hand/leap/grab.json.lz in it; its closed hand is put on things of the room as it is (above) and
as the world lays it on them (below). Needs an OpenGL context (software is fine).
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from docs.pictures.drawing.implicit_render import label
from docs.pictures.drawing.mesh_render import Part, Studio
from docs.pictures.touching.figures_touching import dressed
from vistel.arrays import F64
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.figure import Figure
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix
from vistel.space.dynamics.solids import solids
from vistel.space.hands.fitting import fit
from vistel.space.hands.grasp import align
from vistel.space.people import HAND_JOINT, build_like
from vistel.space.room import meeting_room
from vistel.space.things.tessellate import tessellate_thing
from vistel.space.things.things import Thing

ROOT = Path(__file__).resolve().parents[3]
from benchmarks.figures import grasp_trials  # of this repository, not installed

THINGS = {"baton": 0.020, "ball": 0.045, "box": 0.040, "can": 0.040, "cone": 0.040, "tile": 0.015}
"""How far from the palm each lies as the hand comes to it [m]."""
SIZE = (230, 230)
_ARMS = Posture()


def hands_on(studio: Studio, figure: Figure, held: Thing, low: float, fingers: F64) -> list[Image.Image]:
    """The hand as recorded, and as it holds the thing."""
    avatar = figure.avatar
    build = build_like(Proportions.of(avatar.skeleton, avatar.body))
    spread = _ARMS
    turned = _across(held)
    axis = matrix_from_quaternion(turned) @ held.axes[0].point if held.axes else np.zeros(3)
    lie = Pose(build.palm[1] - np.array([0.0, low, 0.0]) - axis, turned)
    aim = align(held, lie, build.palm[1])
    part = solids((held,)).part(0).moved(aim.matrix, aim.position)
    found = fit(build, True, fingers, (True,) * 4, part, to_palm=True)
    out: list[Image.Image] = []
    for angles, (position, rotation) in ((fingers, lie), (found.fingers, (aim.position + found.shift, aim.rotation))):
        posture = Posture(spread.dofs, np.stack([spread.hands[0], angles]))
        joints, j = pose_joints(avatar.skeleton, posture), HAND_JOINT[1]
        r, p = joints.rotation[j], joints.position[j]
        place, turn = p + r @ position, r @ matrix_from_quaternion(rotation)
        parts = dressed(figure, figure.pose(posture))
        colour = tuple(((held.colour >> s) & 255) / 255 for s in (24, 16, 8))
        for surface in tessellate_thing(held):
            seen = surface.moved(place, quaternion_from_matrix(np.ascontiguousarray(turn)))
            parts.append(Part.plain(seen.vertices, seen.triangles, colour))
        centre = p + r @ (build.palm[1] - np.array([0.02, 0.035, 0.0]))
        eye = centre + r @ np.array([-0.22, -0.12, 0.30])
        out.append(studio.photograph(parts, tuple(eye), tuple(centre), SIZE, 0.42))
    return out


def _across(held: Thing) -> F64:
    """The rotation that lays the thing's first axis across the palm, a little askew."""
    axis = held.axes[0].direction if held.axes else np.array([0.0, 0.0, 1.0])
    z = np.array([np.sin(0.35), 0.0, np.cos(0.35)])
    turn = np.cross(axis, z)
    sine = float(np.linalg.norm(turn))
    angle = np.arctan2(sine, float(axis @ z))
    return quaternion_from_matrix(matrix_from_rotvec(turn * (angle / max(1e-9, sine))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "grasps.png")
    parser.add_argument("--recordings", type=Path, default=grasp_trials.DATA)
    arguments = parser.parse_args()
    grasp_trials.DATA = arguments.recordings
    if not (grasp_trials.DATA / "hand").is_dir():
        print(f"grasps: no recorded hands in {arguments.recordings}; name their folder with --recordings")
        return
    fingers, grab, _ = grasp_trials.recorded("grab")
    closed = int(np.argmax(grab >= grasp_trials.CLOSED))
    room, studio = meeting_room(3), Studio()
    figure = Figure(builtin_avatar("builtin:person=erik", name="grasps", height=1.75))
    columns: list[list[Image.Image]] = []
    for name, low in THINGS.items():
        pictures = hands_on(studio, figure, room.thing(name), low, fingers[closed])
        columns.append([label(i, text) for i, text in zip(pictures, (f"{name}, as recorded", "held"), strict=True)])
    high = columns[0][0].height
    out = Image.new("RGB", (SIZE[0] * len(columns), 2 * high), "white")
    for i, column in enumerate(columns):
        for j, image in enumerate(column):
            out.paste(image, (i * SIZE[0], j * high))
    out.save(arguments.out, optimize=True)


if __name__ == "__main__":
    main()

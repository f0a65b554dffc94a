"""Pictures of what lies under a figure's skin (docs/explanation/layers.md).

    python -m docs.pictures.people.layers [AVATAR]

writes layers.png (bones, muscles, skin; the arm straight and bent; traced), layers-skin.png (the drawn skin without and with
its layers) and layers-sweep.png (an elbow from 0 to 150 degrees) beside this file. AVATAR: an avatar file instead of the
built-in person. Needs an OpenGL context (EGL without a display; software is fine).
"""

import argparse
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

import vistel.implicit as vi
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.figure import Figure
from vistel.figure.formats.load import load_any
from vistel.figure.layers.model import Layer, LayeredModel, layered_model
from vistel.figure.layers.places import Places
from vistel.figure.layers.scene_text import COLOURS
from vistel.figure.layers.skin import Anatomy, SkinLayers
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import ELBOW, SHOULDER, Posture, pose_joints
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINT_INDEX
from vistel.implicit.scene import Scene, encoded
from vistel.implicit.scene.model import Camera, Light
from vistel.implicit.scene.surface import Material
from vistel.implicit.trace import render
from vistel.render.figures.portrait import Portraits

OUT = Path(__file__).parent
PERSON = "builtin:person=jonas"
TILE, STEP = (430, 340), (196, 196)
View = tuple[Posture, str, tuple[float, float, float], float]
"""Posture; joints in the middle of the picture; the camera from there [m]; its opening [rad]."""


def palms_up(degrees: float) -> Posture:
    """Arms sideways with their palms up, elbows bent upwards."""
    dofs = Posture().dofs.copy()
    for side in ("left", "right"):
        dofs[SHOULDER[side]], dofs[ELBOW[side]] = (-math.pi / 2, 0.0, 0.0), math.radians(degrees)
    return Posture(dofs)


def traced(model: LayeredModel, avatar: Avatar, layers: tuple[Layer, ...]) -> Image.Image:
    """Some layers uncovered, or the blended figure where the skin is among them."""
    if "skin" in layers:
        shape: vi.Shape = Material(colour=COLOURS["skin"]).on(model.blended(layers))
    else:
        shape = vi.union(*(Material(colour=COLOURS[p.layer]).on(p.shape) for p in model.layer(*layers)))
    x, y, z = avatar.skeleton.rest[JOINT_INDEX["left_upper_arm"]] + (0.21, 0.05, 0.0)
    scene = Scene(
        Camera((x + 0.10, y + 0.12, z + 1.42), (x, y, z), field_of_view=0.76),
        shape,
        size=TILE,
        background=(0.78, 0.80, 0.83),
        lights=[Light(position=(1.0, 3.0, 2.0)), Light(towards=(-1.0, 0.5, 0.4), colour=(0.35, 0.35, 0.4), shadows=False)],
    )
    return Image.fromarray(encoded(render(scene, depth=0, antialias=0.1).light))


def layer_sheet(avatar: Avatar) -> Image.Image:
    """Bones, muscles and skin side by side, straight above bent."""
    anatomy = Anatomy.of(Places(avatar))
    kinds: tuple[tuple[Layer, ...], ...] = (
        ("bones",),
        ("bones", "muscles", "tendons"),
        ("skin", "joints", "muscles", "bones", "veins"),
    )
    rows: list[Image.Image] = []
    for degrees in (6.0, 110.0):
        model = layered_model(avatar, anatomy, pose_joints(avatar.skeleton, palms_up(degrees)))
        rows += [traced(model, avatar, layers) for layers in kinds]
    return grid(rows, len(kinds))


def grid(pictures: list[Image.Image], columns: int) -> Image.Image:
    """Pictures of one size in rows."""
    w, h = pictures[0].size
    out = Image.new("RGB", (columns * w, -(-len(pictures) // columns) * h), "white")
    for i, picture in enumerate(pictures):
        out.paste(picture, ((i % columns) * w, (i // columns) * h))
    return out


def shot(portraits: Portraits, figure: Figure, view: View, size: tuple[int, int]) -> Image.Image:
    posture, joints, away, angle = view
    position = figure.pose(posture).joints.position
    middle = np.mean([position[JOINT_INDEX[j]] for j in joints.split("+")], axis=0)
    return portraits.picture(figure, posture, tuple(middle + away), tuple(middle), size, angle)


def skin_sheet(portraits: Portraits, avatar: Avatar) -> Image.Image:
    """The drawn skin following the joints alone, above with its layers."""
    figure, postures = Figure(avatar), standard_postures()
    layers = SkinLayers(figure)
    arm = "left_upper_arm+left_lower_arm"
    views: list[View] = [
        (palms_up(110.0), arm, (0.0, 0.05, 0.85), 0.45),
        (postures["elbow"], "left_lower_arm", (0.75, 0.10, -0.35), 0.36),
        (postures["fists"], "left_hand+left_middle_proximal", (0.24, 0.16, 0.30), 0.36),
        (postures["overhead"], "neck", (0.35, 0.25, 1.2), 0.50),
        (postures["sitting"], "left_lower_leg", (0.9, 0.1, -0.5), 0.50),
    ]
    out: list[Image.Image] = []
    for under in (None, layers):
        figure.layers = under
        out += [shot(portraits, figure, view, (250, 250)) for view in views]
    return grid(out, len(views))


def sweep_sheet(portraits: Portraits, avatar: Avatar) -> Image.Image:
    """An elbow from 0 to 150 degrees, from in front and above."""
    figure = Figure(avatar)
    figure.layers = SkinLayers(figure)
    views = [(palms_up(float(d)), "left_upper_arm+left_lower_arm", (0.05, 0.12, 0.9), 0.45) for d in range(0, 151, 25)]
    return grid([shot(portraits, figure, view, STEP) for view in views], len(views))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("avatar", nargs="?", default=PERSON)
    parser.add_argument("--out", type=Path, default=OUT)
    arguments = parser.parse_args()
    file = Path(arguments.avatar)
    avatar = load_any(file) if file.is_file() else builtin_avatar(arguments.avatar, name="layers", height=1.75)
    layer_sheet(avatar).save(arguments.out / "layers.png", optimize=True)
    # Plain clay shows the shape.
    clay = replace(avatar, albedo=np.full((8, 8, 3), (205, 160, 135), np.uint8), coarser=())
    portraits = Portraits()
    for name, sheet in (("layers-skin", skin_sheet), ("layers-sweep", sweep_sheet)):
        sheet(portraits, clay).save(arguments.out / f"{name}.png", optimize=True)
    portraits.close()


if __name__ == "__main__":
    main()

"""`vistel avatar layers`: an avatar's bones, muscles and veins in a posture, as a scene file."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from vistel_cli.avatar.files import Json, busy, load_or_make, report
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import ARRAYS, GLTF, USD
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import FAILED, USAGE, fail

_FROM = (0.45, 0.25, 1.6)
"""Distance from the figure's middle to the camera, in units of the figure's size."""


class VisibleLayers(StrEnum):
    """The layers that the scene shows."""

    skin = "skin"
    muscles = "muscles"
    bones = "bones"


def layers(
    file: Annotated[str, Takes(USD, GLTF, ARRAYS, names=True), typer.Argument(help='An avatar file, or "builtin:person=carla".')],
    output: Annotated[Path, out_file("The scene file to write, .toml.")],
    posture: Annotated[str, typer.Option(help="One of the standard postures, such as t-pose, elbow or squat.")] = "elbow",
    visible: Annotated[
        VisibleLayers, typer.Option("--layers", help="All layers blended, or muscles and bones, or bones uncovered.")
    ] = VisibleLayers.skin,
    physical: Annotated[
        bool, typer.Option("--physical", help="Muscles swell by their blend functions instead of by their size.")
    ] = False,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Write an avatar's layers (bones, muscles, veins, skin) as one implicit model, in a scene file for `vistel trace`.

    [bold]Examples[/bold]

      vistel avatar layers builtin:person=carla -o arm.toml --posture elbow --layers muscles
    """
    import numpy as np

    from vistel.figure.layers.model import Layer, layered_model  # - the mathematics take long to load
    from vistel.figure.layers.places import Places
    from vistel.figure.layers.scene_text import scene_text
    from vistel.figure.layers.skin import Anatomy
    from vistel.figure.posture.posture import pose_joints
    from vistel.figure.posture.standard import standard_postures

    postures = standard_postures()
    if posture not in postures:
        fail(f"--posture: is {posture!r}, expected one of {', '.join(postures)}", USAGE)
    avatar = load_or_make(file)
    kinds: dict[VisibleLayers, tuple[Layer, ...]] = {
        VisibleLayers.skin: ("skin", "joints", "muscles", "bones", "veins"),
        VisibleLayers.muscles: ("bones", "muscles", "tendons"),
        VisibleLayers.bones: ("bones",),
    }
    with busy("building the layers", not as_json):
        joints = pose_joints(avatar.skeleton, postures[posture])
        model = layered_model(avatar, Anatomy.of(Places(avatar)), joints, physical=physical)
        low, high = joints.position.min(axis=0), joints.position.max(axis=0)
        middle = 0.5 * (low + high)
        away = 1.05 * float(max((high - low).max(), avatar.skeleton.height))
        text = scene_text(
            model, kinds[visible], blended=visible is VisibleLayers.skin, eye=middle + away * np.array(_FROM), target=middle
        )
    try:
        output.write_text(text)
    except OSError as fault:
        fail(f"{output}: cannot be written: {fault.strerror or fault}", FAILED)
    counts = {layer: len(model.layer(layer)) for layer in kinds[visible]}
    report(as_json, {"output": str(output), "posture": posture, **counts})

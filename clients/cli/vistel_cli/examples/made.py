"""The files of `vistel examples`: what each is, what to type next, and how it is made."""

from __future__ import annotations

import math
import shutil
import wave
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from vistel.conference.files import DEMO_FILE
from vistel.figure.avatar.avatar import Avatar
from vistel_cli.examples.slides import SLIDES, pdf

SHIPPED = Path(__file__).parent / "files"
"""The repository's folder `examples`."""
PERSON = "builtin:person=carla"
"""One of the demo, who is made once."""
SAID = "move the yellow ball to the right"
SCAN = ("scan.obj", "scan.mtl", "scan.png")
CHARACTER = ("character.vrm", "character.glb", "character.usdz")
RECORDED = ("recordings/walk.bvh", "recordings/handover")
LAMP_DEGREES = 120.0
"""Where the light of the photograph comes from, counter-clockwise from the right."""


class CannotBeMadeError(Exception):
    """Something that the machine lacks, in one line."""


@dataclass(frozen=True)
class Example:
    """files: names in the folder, the first is shown; what: one line about it; command: what to try next."""

    files: tuple[str, ...]
    what: str
    command: str
    make: Callable[[Path], None]


def _conference(folder: Path) -> None:
    shutil.copyfile(DEMO_FILE, folder / "conference.toml")


def _me(folder: Path) -> None:
    shutil.copyfile(SHIPPED / "conferences" / "me.toml", folder / "me.toml")


def _shipped(folder: Path) -> None:
    shutil.copytree(SHIPPED, folder / "examples", ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)


def _mug(folder: Path) -> None:
    import trimesh  # - takes long to load
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    outer, inner, high = 0.040, 0.036, 0.095
    profile = [(0.0, 0.0), (outer, 0.0), (outer, high), (inner, high), (inner, 0.005), (0.0, 0.005)]
    cup = trimesh.creation.revolve(profile, sections=48)
    cup.apply_transform(trimesh.transformations.rotation_matrix(-math.pi / 2.0, (1.0, 0.0, 0.0)))  # Y up
    bend = np.concatenate(([-0.5], np.linspace(-0.5, 0.5, 25), [0.5]))[:, None] * math.pi
    round_ = np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False)
    thick = np.where(np.arange(27) % 26 == 0, 0.0, 0.005)[:, None]  # closed at both ends
    across = 0.026 + thick * np.cos(round_)
    tube = np.stack((0.038 + across * np.cos(bend), 0.05 + across * np.sin(bend), thick * np.sin(round_)), axis=-1)
    k = np.arange(26 * 12).reshape(26, 12)
    beside = np.roll(k, -1, axis=1)
    quads = np.stack((k, k + 12, beside + 12, beside), axis=-1).reshape(-1, 4)
    faces = np.concatenate((quads[:, :3], quads[:, [0, 2, 3]]))
    glaze = PBRMaterial(baseColorFactor=(62, 110, 140, 255), roughnessFactor=0.4, metallicFactor=0.0)
    vertices = np.concatenate((cup.vertices, tube.reshape(-1, 3)))
    mug = trimesh.Trimesh(vertices, np.concatenate((cup.faces, faces + len(cup.vertices))), visual=TextureVisuals(material=glaze))
    scene = trimesh.Scene()
    scene.add_geometry(mug, node_name="mug", geom_name="mug")
    scene.export(folder / "mug.glb")


@cache
def _person() -> Avatar:
    from vistel.figure.people.builtin import builtin_avatar

    return builtin_avatar(PERSON, name="carla", height=1.71)


def _scan(folder: Path) -> None:
    from vistel.figure.formats.obj import export_obj

    export_obj(_person(), folder / "scan.obj")


def _character(folder: Path) -> None:
    from vistel.figure.formats.gltf import save_gltf
    from vistel.figure.formats.usd import save_usd

    save_gltf(_person(), folder / "character.vrm", author="VISTEL")
    save_gltf(_person(), folder / "character.glb")
    save_usd(_person(), folder / "character.usdz")


def _face(folder: Path) -> None:
    from PIL import Image

    Image.fromarray(_person().albedo).resize((256, 256)).save(folder / "face.png")


def _slides(folder: Path) -> None:
    (folder / "slides.pdf").write_bytes(pdf(SLIDES))


def _sleeve(folder: Path) -> None:
    from PIL import Image

    from vistel.wrinkle.displacement import displacement_map
    from vistel.wrinkle.instance import Instance
    from vistel.wrinkle.shape_file import builtin_shapes
    from vistel.wrinkle.texture import Lighting, wrinkled_texture

    wrinkle = Instance(builtin_shapes()["sleeve_bend"], (0.5, 0.5), (0.33, 0.33), 0.05, 0.03)
    height = displacement_map([wrinkle], (1.0, 1.0), 500)
    cloth = np.full((*height.height.shape, 3), (150, 140, 128), np.uint8)
    lamp = math.radians(LAMP_DEGREES)
    picture = wrinkled_texture(cloth, height, Lighting((0.65 * math.cos(lamp), 0.65 * math.sin(lamp), 0.7)))[0]
    Image.fromarray(picture).save(folder / "sleeve.jpg", quality=95)


def _recordings(folder: Path) -> None:
    from vistel_sim.motion.write import write_hand_over, write_walk

    (folder / "recordings").mkdir(exist_ok=True)
    write_walk(folder / "recordings" / "walk.bvh")
    write_hand_over(folder / "recordings" / "handover")


def _said(folder: Path) -> None:
    from vistel.speech.synthesis import PLAIN, SynthesisError, synthesise

    try:
        sound, rate = synthesise(SAID, PLAIN["en"])
    except SynthesisError as e:
        raise CannotBeMadeError(str(e)) from e
    (folder / "recordings").mkdir(exist_ok=True)
    for file in (folder / "said.wav", folder / "recordings" / f"{SAID.replace(' ', '-')}.wav"):
        with wave.open(str(file), "wb") as w:
            w.setparams((1, 2, round(rate), 0, "NONE", ""))
            w.writeframes((32767.0 * sound).astype("<i2").tobytes())


def _points(folder: Path) -> None:
    """A grid of points, and where a tracker near a steel desk sees them."""
    grid = np.stack(np.meshgrid(*(np.arange(-0.4, 0.41, 0.2),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    grid += (0.0, 0.0, 0.6)
    away = grid - (0.0, -0.9, 0.6)
    near = 0.01 / (away * away).sum(axis=1, keepdims=True)
    rows = [",".join(f"{v:.5f}" for v in (*true, *read)) for true, read in zip(grid, grid + near * away, strict=True)]
    (folder / "points.csv").write_text("\n".join(["true_x,true_y,true_z,read_x,read_y,read_z", *rows]) + "\n", "utf-8")


EXAMPLES = (
    Example(("conference.toml",), "three sites with simulated devices", "vistel up conference.toml --seconds 20", _conference),
    Example(("me.toml",), "you and a simulated person", "vistel up me.toml", _me),
    Example(("examples",), "conferences, rooms, scenes, wrinkles, programs", "vistel world show examples/rooms/den.usdz", _shipped),
    Example(("mug.glb",), "a mug", "vistel world show mug.glb", _mug),
    Example(SCAN, "a mesh of a person, without bones", "vistel avatar import scan.obj -o me.usda", _scan),
    Example(CHARACTER, "a person with bones; also as .glb and .usdz", "vistel avatar inspect character.vrm", _character),
    Example(("slides.pdf",), "three slides", "vistel show slides.pdf --as aiko", _slides),
    Example(("face.png",), "a picture for a part of a figure's texture", "vistel avatar register --help", _face),
    Example(("sleeve.jpg",), "cloth, lit from one side", "vistel wrinkle trace sleeve.jpg -o my_shape.toml --lamp 120", _sleeve),
    Example(("points.csv",), "points measured near metal", "vistel calibrate distortion points.csv --step 0.1", _points),
    Example(RECORDED, "recorded motion; beside it a hand-over", "vistel up --motion recordings/walk.bvh", _recordings),
    Example(("said.wav",), "a spoken command", "vistel speech try said.wav --language en", _said),
)

"""Draws a sheet of each person: the face from three sides at rest, smiling, speaking and with its eyes shut; hands; postures; in
soft (fine) and in hard (fast) light. MakeHuman's own man and woman too, where their files are in ../shared/data.

    python -m docs.pictures.people.sheets [--out FOLDER] [--size PIXELS] [PERSON ...]
    python -m docs.pictures.people.sheets --glasses           # glasses.png, each kind on somebody

PERSON: one of the ten, all by default, or what follows "builtin:". Needs an OpenGL context (software is fine).
"""

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.looks_human.makehuman import PEERS, has_peers, peer
from docs.pictures.drawing.implicit_render import label
from vistel.arrays import F64
from vistel.figure.body_model.builtin_people import PEOPLE
from vistel.figure.face.marks import Expressions
from vistel.figure.posture.hands import FIST, FLAT, POINT
from vistel.figure.posture.posture import ELBOW, SHOULDER, Posture, Stance, pose_joints, standing
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix, rotvec_from_quaternion
from vistel.protocol.live_link_face import CHANNELS
from vistel.render.figures.cache import cached_figure
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.people import load_figure
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import Camera, look_at

LIGHTS = {"soft": "fine", "hard": "fast"}
PLACE, HEADING = np.array((1.6, 0.0, 0.4)), math.radians(-70.0)
"""Where in the room they stand [m], and which way they look [rad]."""
SIDES = {"front": 0.0, "three quarters": 40.0, "profile": 90.0}
FACES: dict[str, tuple[dict[str, float], tuple[float, float]]] = {
    "neutral": ({}, (1.0, 1.0)),
    "smiling": ({"mouthSmile": 0.9, "cheekSquint": 0.5}, (1.0, 1.0)),
    "speaking": ({"jawOpen": 0.35, "mouthFunnel": 0.2}, (1.0, 1.0)),
    "eyes shut": ({}, (0.0, 0.0)),
}
HANDS = {"open hand": FLAT, "fist": FIST, "pointing": POINT}
_WEARERS = {"ben": "round", "aiko": "rectangular", "david": "half_rim"}
_STEPS = 3
_STEP_NS = 400_000_000
_NO_TIMING = Timing(0, 0, 0, False)


def postures() -> dict[str, Posture]:
    """Whole bodies, by name."""
    known = standard_postures()
    return {
        "standing": known["standing"],
        "sitting": known["sitting"],
        "arms crossed": arms(standing(), elbow=112.0, hang=66.0, forward=26.0, inwards=62.0),
        "reaching": arms(standing(), elbow=14.0, hang=82.0, forward=78.0, sides=("left",)),
        "bowing": known["bow"],
    }


def arms(
    base: Posture, *, elbow: float, hang: float, forward: float, inwards: float = 0.0, sides: tuple[str, ...] = ("left", "right")
) -> Posture:
    """A posture with other arms [degrees]; hang: of the upper arms below the horizontal; forward: then swung to the front; inwards:
    turned about themselves, so that forearms go to the other side."""
    dofs = base.dofs.copy()
    for side in sides:
        sign = 1.0 if side == "left" else -1.0
        turns = ((inwards, 0.0, 0.0), (0.0, 0.0, -sign * hang), (-forward, 0.0, 0.0))
        about, down, front = (matrix_from_rotvec(np.radians(turn)) for turn in turns)
        dofs[SHOULDER[side]] = rotvec_from_quaternion(quaternion_from_matrix(front @ down @ about))
        dofs[ELBOW[side]] = math.radians(elbow)
    return replace(base, dofs=dofs)


class Sheets:
    """Draws them with the renderer that a site has, tiles of `size` pixels. Create, use and close in one thread."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._now_ns = 0
        self._figures: dict[str, AvatarFigure] = {}
        self._renderer = SceneRenderer(View(size, size, "room", "", light="fine", names=False), 3, self._load)
        self._renderer.painter.saves_shadows = False

    def close(self) -> None:
        """Give the context back."""
        self._renderer.close()

    def sheet(self, name: str) -> Image.Image:
        """All pictures of a person, a line for each light and side or kind."""
        lines = [[self._tile(name, word, light, *shown) for word, shown in line] for light in LIGHTS for line in self._lines(name)]
        high, wide = lines[0][0].height, max(len(line) for line in lines)
        out = Image.new("RGB", (wide * self._size, len(lines) * high), "white")
        for row, line in enumerate(lines):
            for column, tile in enumerate(line):
                out.paste(tile, (column * self._size, row * high))
        return out

    def glasses(self) -> Image.Image:
        """Each kind of glasses on somebody, side by side."""
        out = Image.new("RGB", (len(_WEARERS) * self._size, self._size), "white")
        for column, (who, kind) in enumerate(_WEARERS.items()):
            name = f"person={who},glasses={kind}"
            tile = self._tile(name, kind, "soft", *self._face(name, "neutral", SIDES["three quarters"]))
            out.paste(tile.crop((0, 0, self._size, self._size)), (column * self._size, 0))
        return out

    def _lines(self, name: str) -> Iterator[list[tuple[str, tuple[Posture, Camera]]]]:
        for side, angle in SIDES.items():
            yield [(f"{face}, {side}", self._face(name, face, angle)) for face in FACES]
        yield [(word, self._hand(name, fingers)) for word, fingers in HANDS.items()]
        yield [(word, self._whole(name, posture)) for word, posture in postures().items()]

    def _face(self, name: str, face: str, angle: float) -> tuple[Posture, Camera]:
        units, lids = FACES[face]
        marks = Expressions(CHANNELS).marks([units.get(c.removesuffix("Left").removesuffix("Right"), 0.0) for c in CHANNELS])
        posture = _here(replace(standing(), face=marks, lids=np.array(lids)))
        middle = self._joints(name, posture)[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0) - (0.0, 0.035, 0.0)
        return posture, _before(middle, math.radians(angle), 0.75, 0.05, 0.40)

    def _hand(self, name: str, fingers: F64) -> tuple[Posture, Camera]:
        posture = _here(replace(arms(standing(), elbow=100.0, hang=74.0, forward=24.0), hands=np.stack([fingers, fingers])))
        middle = self._joints(name, posture)[JOINT_INDEX["left_middle_proximal"]]
        return posture, _before(middle, math.radians(35.0), 0.55, 0.25, 0.50)

    def _whole(self, name: str, posture: Posture) -> tuple[Posture, Camera]:
        posture = _here(posture)
        at = self._joints(name, posture)
        middle = 0.5 * (at.min(axis=0) + at.max(axis=0))
        return posture, _before(middle, math.radians(25.0), 2.6, 0.1, math.radians(46.0))

    def _joints(self, name: str, posture: Posture) -> F64:
        about = _about(name)
        if name not in self._figures:
            self._load(about)
        return pose_joints(self._figures[name].skeleton, posture).position

    def _tile(self, name: str, word: str, light: str, posture: Posture, camera: Camera) -> Image.Image:
        who = (PersonNow(_about(name), posture, _NO_TIMING),)
        self._renderer.camera = camera
        self._renderer.relight(LIGHTS[light])
        # Levels of detail are chosen by how large people were in the picture before, and faces take their time.
        shown = [self._renderer.render_complete(Instant(self._later(), who, PlayoutWorld(1, {}), {})) for _ in range(_STEPS)]
        return label(Image.fromarray(np.ascontiguousarray(shown[-1][::-1, :, :3])), f"{word}, {light} light")

    def _later(self) -> int:
        self._now_ns += _STEP_NS
        return self._now_ns

    def _load(self, about: ParticipantInfo) -> AvatarFigure:
        figure = cached_figure(peer(about.avatar)) if about.avatar in PEERS else load_figure(about)
        self._figures[about.name] = figure
        return figure


def _about(name: str) -> ParticipantInfo:
    if name in PEERS:
        return ParticipantInfo(name, name, name, 1.75)
    known = PEOPLE.get(name)
    spec = f"builtin:person={name}" if known else f"builtin:{name}"
    return ParticipantInfo(name, name, spec, (known.height if known else None) or 1.70)


def _here(posture: Posture) -> Posture:
    return replace(posture, stance=Stance(PLACE, HEADING))


def _before(middle: F64, angle: float, away: float, up: float, field_of_view: float) -> Camera:
    way = np.array((math.sin(HEADING + angle), up, math.cos(HEADING + angle)))
    return look_at(middle + away * way, middle, field_of_view)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("people", nargs="*", metavar="PERSON")
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--size", type=int, default=360)
    parser.add_argument("--glasses", action="store_true")
    arguments = parser.parse_args()
    sheets = Sheets(arguments.size)
    try:
        if arguments.glasses:
            sheets.glasses().save(Path(__file__).with_name("glasses.png"), optimize=True)
            return
        for name in arguments.people or (*PEOPLE, *(PEERS if has_peers() else ())):
            sheets.sheet(name).save(arguments.out / f"{name.replace(' ', '-')}.png")
    finally:
        sheets.close()


if __name__ == "__main__":
    main()

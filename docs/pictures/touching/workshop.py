"""Draws workshop.png: a lid that is opened by hand, a drawer, a button, and a door that opens on a command.

    python -m docs.pictures.touching.workshop [--out FILE] [--film FOLDER]

FOLDER: writes every sixth step of the whole as a picture, to look whether anything jumps. Needs an OpenGL context (software is
fine).
"""

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from docs.pictures.conferences.scenes import ROOT, STEP_NS, Moment, Played, photograph
from vistel.arrays import U8
from vistel.conference.files import load
from vistel.conference.rooms import interior_of
from vistel.render.figures.people import load_figure
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.view.camera import Camera, look_at
from vistel.space.commands.phrase import read
from vistel.space.inputs import CommandInput
from vistel_sim.motion.open import open_motion

FILE = ROOT / "examples" / "conferences" / "workshop.toml"
OUT = Path(__file__).with_name("workshop.png")
SIZE = (480, 360)
SHOWN = {4.4: "lid", 11.0: "drawer", 14.85: "button", 19.5: "door"}
"""When the pictures are taken [s]."""
ASKED = {17.6: "open the door"}
"""What Ben asks for, and when [s]."""
LASTS = 19.6
"""[s]"""


def played() -> Iterator[tuple[float, Moment]]:
    """Every step: its time [s], and what is seen."""
    conference = load(FILE)
    people = [p for site in conference.sites for p in site.participants]
    play = Played(interior_of(conference.room), **{p.name: p.avatar for p in people})
    motion = open_motion(conference, {p.name: play.limbs(p.name) for p in people})
    for k in range(1, round(LASTS * 60)):
        t = k * STEP_NS * 1e-9
        asked = [CommandInput(f"c{k}", people[1].name, read(line)) for at, line in ASKED.items() if t - 1 / 60 < at <= t]
        play.step(*asked, **{p.name: motion.posture(p.name, t) for p in people})
        yield t, play.now(_camera())


def _camera() -> Camera:
    """Over Aiko's left shoulder, on the bench."""
    return look_at(np.array([0.62, 1.48, -0.80]), np.array([0.0, 0.83, -0.10]), math.radians(44.0))


def film(folder: Path) -> None:
    """A picture of every sixth step."""
    folder.mkdir(parents=True, exist_ok=True)
    studio: SceneRenderer | None = None
    for n, (t, moment) in enumerate(played()):
        if n % 6:
            continue
        if studio is None:
            studio = SceneRenderer(replace(moment.view, width=SIZE[0], height=SIZE[1]), moment.seats, load_figure, moment.decor)
            studio.painter.saves_shadows = False
        studio.camera = moment.camera
        picture = studio.render(moment.instant)
        while not studio.complete:
            time.sleep(0.02)
            picture = studio.render(moment.instant)
        Image.fromarray(np.ascontiguousarray(picture[::-1, :, :3])).save(folder / f"{n:04d}-{t:05.2f}s.png")
    if studio is not None:
        studio.close()


def sheet() -> U8:
    """(2 height, 2 width, 3) the four pictures."""
    left = sorted(SHOWN)
    pictures: list[U8] = []
    for t, moment in played():
        if left and t >= left[0]:
            left.pop(0)
            pictures.append(photograph(moment, *SIZE))
    rows = [np.concatenate(pictures[n : n + 2], axis=1) for n in (0, 2)]
    return np.concatenate(rows, axis=0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--film", type=Path)
    given = parser.parse_args()
    if given.film:
        film(given.film)
    else:
        Image.fromarray(sheet()).save(given.out, optimize=True)


if __name__ == "__main__":
    main()

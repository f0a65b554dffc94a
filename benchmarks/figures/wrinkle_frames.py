"""What wrinkles add to the renderer's pictures: three dressed figures round a table, with wrinkles and without, in turns."""

import math
import pickle
import sys
import time
from collections.abc import Iterator

import numpy as np

from benchmarks.row import Row, ratio_at_most
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import ELBOW, KNEE, Posture, Stance, standing
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.people import load_figure
from vistel.render.figures.wrinkles import WrinkleState
from vistel.render.gl.context import NoOpenGlError
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.space.room import seat_pose
from vistel.wrinkle.dressing import dressed
from vistel.wrinkle.shown import shown
from vistel.wrinkle.wrinkle_sets import wrinkle_sets

WIDTH, HEIGHT = 640, 360
PICTURES, ROUNDS = 24, 9


def rows(people: tuple[str, ...]) -> Iterator[Row]:
    """Every figure. people: specifications of built-in ones."""
    yield from _making(people[0])
    persons: dict[str, tuple[AvatarFigure, WrinkleState | None]] = {}

    def load(about: ParticipantInfo) -> AvatarFigure:
        person = load_figure(about)
        persons[about.name] = person, person.wearing
        return person

    try:
        studio = SceneRenderer(View(WIDTH, HEIGHT, "room", ""), 3, load)
    except NoOpenGlError as fault:
        print(f"wrinkle: no picture: {fault}", file=sys.stderr)
        return
    try:
        number = 0
        while not studio.complete or number < 3:
            studio.render(_instant(number, people))
            number += 1
            time.sleep(0.02)

        def drawn(creased: bool) -> float:
            for person, worn in persons.values():
                person.wearing = worn if creased else None
            began = time.process_time()
            for k in range(PICTURES):
                studio.render(_instant(k, people))
            return 1e3 * (time.process_time() - began) / PICTURES

        drawn(True), drawn(False)
        pairs = [(drawn(True), drawn(False)) for _ in range(ROUNDS)]
        ours, theirs = (float(np.median(values)) for values in zip(*pairs, strict=True))
        share = float(np.median([a / b for a, b in pairs]))
        renderer = "software GL" if studio.capability.software else studio.capability.renderer
        case = f"3 dressed figures, {WIDTH}x{HEIGHT}, {renderer}"
        yield Row(
            "wrinkle", case, "processor time per picture", "ms", ours, "without", theirs, ratio=share, target=ratio_at_most(1.1)
        )
    finally:
        studio.close()


def _making(spec: str) -> Iterator[Row]:
    avatar = builtin_avatar(f"builtin:{spec}", name=spec, height=1.75)
    began = time.process_time()
    made = dressed(avatar)
    whole = shown(made, wrinkle_sets())
    took = time.process_time() - began
    case = "dressing a built-in figure, once"
    yield Row("wrinkle", case, "processor time", "s", took)
    size = 1e-6 * len(pickle.dumps(whole, 5))
    more = 1e-6 * (made.avatar.albedo.nbytes - avatar.albedo.nbytes)
    yield Row("wrinkle", case, "wrinkles kept on disk", "MB", size)
    yield Row("wrinkle", case, "textures of sleeves and legs", "MB", more)


def _instant(k: int, people: tuple[str, ...]) -> Instant:
    """Sitting people who bend and stretch their arms."""
    here: list[PersonNow] = []
    for seat, spec in enumerate(people):
        share = 0.5 - 0.5 * math.cos(2.0 * math.pi * k / PICTURES + seat)
        dofs = standing().dofs.copy()
        dofs[ELBOW["left"]], dofs[ELBOW["right"]] = math.radians(20.0 + 100.0 * share), math.radians(120.0 - 100.0 * share)
        dofs[KNEE] = math.radians(90.0)
        at, heading = seat_pose(3, seat)
        posture = Posture(dofs, stance=Stance(np.array(at), heading))
        here.append(PersonNow(ParticipantInfo(spec, spec, f"builtin:{spec}", 1.75), posture, Timing(0, 0, 0, False)))
    return Instant(33_000_000 * k, tuple(here))

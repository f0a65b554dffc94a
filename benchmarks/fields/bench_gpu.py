"""Figures of 10,000 vertices, skinned and deformed by transform feedback on the OpenGL that is here, beside the processor."""

import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from benchmarks.fields.deform_scenes import hugging
from benchmarks.row import Row, at_least
from vistel.figure.figure import Figure
from vistel.figure.figure_plan import FigurePlanner
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import Posture
from vistel.implicit.deformation.ghost_source import GhostSource
from vistel.render.figures.gpu_deform import GpuDeformer, GpuSkin, SkinShape
from vistel.render.gl.context import open_surface

FRAME_MS = 1e3 / 60.0
AIM = 1000
"""Figures that are to be done in a sixtieth of a second."""
ROUNDS = 9


def run() -> Iterator[Row]:
    """One row after the other; half a minute."""
    surface = open_surface()
    software = surface.capability.software
    draws = f"{surface.capability.renderer}, software={'true' if software else 'false'}"
    figure = Figure(builtin_avatar("builtin:person=carla", name="bench", height=1.7))
    planner = FigurePlanner(figure)
    shape, engine = SkinShape.of(planner), GpuDeformer(surface.ctx)
    out = surface.ctx.buffer(reserve=24 * len(shape.corner))
    one, two = hugging()
    ghosts = [figure.ghosts(figure.pose(two).posed)]
    vertices = len(figure.avatar.mesh.vertices)
    cases: tuple[tuple[str, Posture, Sequence[GhostSource]], ...] = (("nothing near", Posture(), ()), ("hugging", one, ghosts))
    for figures in (1, 4) if software else (1, 100, AIM):
        skins = [GpuSkin(engine, shape) for _ in range(figures)]
        for name, posture, acting in cases:
            case = f"{figures} x {vertices} vertices, {name}, {draws}"

            def frame(posture: Posture = posture, acting: Sequence[GhostSource] = acting, skins: list[GpuSkin] = skins) -> None:
                for skin in skins:
                    skin.run(planner.plan(posture, acting).plan, out)
                surface.ctx.finish()

            plan = planner.plan(posture, acting).plan

            def passes(skins: list[GpuSkin] = skins) -> None:
                for skin in skins:
                    skin.run(plan, out)  # called before the loop goes on
                surface.ctx.finish()

            parts = {
                "frame": frame,
                "passes": passes,
                "plans on the CPU": lambda p=posture, a=acting: planner.plan(p, a),
                "cpu": lambda p=posture, a=acting: figure.pose(p, a),
            }
            took = _milliseconds(parts)
            took["plans on the CPU"] *= figures
            beside = figures * took["cpu"]
            for part in ("plans on the CPU", "passes", "frame"):
                yield Row("gpu", case, part, "ms", took[part], "VISTEL's CPU engine, one thread", beside)
            held = figures * FRAME_MS / took["frame"]
            yield Row("gpu", case, "figures per 1/60 s", "1", held, target=at_least(AIM), judged=not software)
        for skin in skins:
            skin.release()
    surface.close()


def _milliseconds(parts: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Median wall time of each, taken in turns."""
    took: dict[str, list[float]] = {name: [] for name in parts}
    for k in range(ROUNDS + 1):
        for name, work in parts.items():
            begun = time.perf_counter()
            work()
            if k:
                took[name].append((time.perf_counter() - begun) * 1e3)
    return {name: float(np.median(t)) for name, t in took.items()}

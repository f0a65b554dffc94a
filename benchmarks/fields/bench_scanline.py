"""Scanline pictures beside VISTEL's own ray caster: five scenes like those of Singh's Table 2, and one edit.

Both draw the same picture (400 x 400, one ray for a pixel, no shadows, no mirrors) from the same compiled field, one
thread each, in turn; processor time, medians. The ray caster is measured twice: as it is (packets of 64 rays where it
knows all primitives), and in its numeric way, ray by ray as the dissertation's.
"""

from collections.abc import Iterator

import numpy as np

import vistel.implicit as vi
from benchmarks.fields.bench_field import alternating
from benchmarks.fields.scanline_scenes import CLAY, table2
from benchmarks.row import Row, at_least, at_most, ratio_at_most
from vistel.implicit.evaluation.program import compile
from vistel.implicit.scanline import Scanline, ScanlinePicture
from vistel.implicit.scene import Scene, encoded
from vistel.implicit.trace import render

TIMES_FASTER = 5.7
"""Than the ray caster, at least."""
REPEATS = 15


def cast(scene: Scene, method: str = "auto") -> ScanlinePicture:
    """The ray caster's picture of what a scanline picture shows."""
    found = render(scene, depth=0, shadows=False, threads=1, method=method)
    return ScanlinePicture(found.light, found.distance.astype(np.float32), found.thing, 1.0)


def run() -> Iterator[Row]:
    for row in table2():
        scene = row.scene
        name = f"figure {row.figure}: {row.name} {'/'.join(map(str, row.counts))}"
        ours, theirs = Scanline(scene).draw(), cast(scene)
        cast(scene, "numeric")
        a, b = alternating(REPEATS, lambda: Scanline(scene).draw(), lambda: cast(scene))
        _, c = alternating(3, lambda: None, lambda: cast(scene, "numeric"))
        yield Row("scanline", name, "picture", "ms", 1e3 * a, "own ray caster", 1e3 * b, target=ratio_at_most(1 / TIMES_FASTER))
        yield Row("scanline", name, "picture", "ms", 1e3 * a, "own ray caster, ray by ray", 1e3 * c)
        seen = int((theirs.thing == 1).sum())
        equal = 1 - float((ours.thing != theirs.thing).sum()) / seen
        yield Row("scanline", name, "equal hit pixels", "1", equal, "own ray caster", target=at_least(0.999))
        both = (ours.thing == 1) & (theirs.thing == 1)
        apart = np.abs(encoded(ours.light).astype(int) - encoded(theirs.light).astype(int)).max(axis=2)[both]
        worst = float(np.quantile(apart, 0.999))
        yield Row("scanline", name, "difference of shades, 99.9 % of pixels", "1/255", worst, "own ray caster", target=at_most(2))
    yield from _edits()


def _edits() -> Iterator[Row]:
    """Moving one of 106 spheres to and fro."""
    row = table2()[1]
    line = Scanline(row.scene)
    line.draw()
    first = row.primitives[0]
    assert isinstance(first, vi.Sphere)
    moved = vi.Sphere((first.centre[0] + 0.05, first.centre[1], first.centre[2]), first.radius)
    shapes = [CLAY.on(vi.total(p, *row.primitives[1:])) for p in (moved, first)]
    turn = 0

    def edit() -> ScanlinePicture:
        nonlocal turn
        turn += 1
        return line.edit(shapes[turn % 2])

    edit()
    picture = edit()
    assert line.surface is not None and line.program is not None
    programs = [compile(Scene(row.scene.camera, shape).solid or shape, origin=line.program.origin) for shape in shapes]
    surface = line.surface

    def redraw() -> None:
        nonlocal turn
        turn += 1
        surface.edit(programs[turn % 2])

    a, b = alternating(REPEATS, edit, lambda: Scanline(row.scene).draw())
    name = "figure 34, one sphere moved"
    yield Row("scanline", name, "edit, field compiled", "ms", 1e3 * a, "whole picture, likewise", 1e3 * b)
    a, b = alternating(REPEATS, redraw, surface.draw)
    yield Row("scanline", name, "depths and normals drawn again", "ms", 1e3 * a, "all drawn", 1e3 * b)
    yield Row("scanline", name, "part of the picture drawn again", "1", picture.redrawn)

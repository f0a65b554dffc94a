"""Pictures of scenes: tiles of rays in parallel, then more rays where neighbouring pixels differ (adaptive antialiasing)."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import I64
from vistel.implicit.scene import Scene
from vistel.implicit.trace.light import Tracer

Box = tuple[int, int, int, int]
BLOCK = 8
"""A packet of rays is a square of so many pixels."""
GRID = 3
"""A pixel that is refined gets GRID x GRID rays."""


@dataclass(frozen=True)
class TracedPicture:
    """light (h, w, 3) linear; distance (h, w) to what is seen [m], infinite for nothing; thing (h, w): 0 nothing,
    1 the implicit surface, 2 polygons; refined: how many pixels got more rays."""

    light: NDArray[np.float32]
    distance: NDArray[np.float32]
    thing: NDArray[np.int8]
    refined: int


def render(
    scene: Scene,
    *,
    size: tuple[int, int] | None = None,
    depth: int = 3,
    shadows: bool = True,
    antialias: float = 0.0,
    method: str = "auto",
    samples: int = 8,
    threads: int | None = None,
    progress: Callable[[float], None] = lambda part: None,
) -> TracedPicture:
    """The picture of a scene.

    antialias: pixels that differ by more from a neighbour, in any colour, get nine rays instead of one; 0 for none.
    threads: how many tiles at once, by default as many as there are cores; progress: called with 0..1 as tiles are done.
    """
    width, height = size or scene.size
    tracer = Tracer(scene, depth, shadows, method, samples).prepare()
    workers = threads or os.cpu_count() or 1
    light = np.empty((height, width, 3), np.float32)
    light[:] = scene.background
    distance = np.full((height, width), np.inf, np.float32)
    thing = np.zeros((height, width), np.int8)

    def tile(box: Box) -> int:
        if tracer.plain is not None:
            tracer.draw(box, light, distance, thing)
            return (box[2] - box[0]) * (box[3] - box[1])
        pixels = _blocked(box)
        seen = tracer.seen(*scene.camera.rays((width, height), pixels + 0.5))
        x, y = pixels.T
        light[y, x], distance[y, x], thing[y, x] = seen.colour, seen.distance, seen.thing
        return len(pixels)

    def refine(pixels: I64) -> int:
        inside = (np.stack(np.meshgrid(*2 * [np.arange(GRID)]), axis=-1).reshape(-1, 2) + 0.5) / GRID
        points = (pixels[:, None] + inside).reshape(-1, 2)
        seen = tracer.seen(*scene.camera.rays((width, height), points))
        x, y = pixels.T
        light[y, x] = np.clip(seen.colour, 0, 1).reshape(len(pixels), -1, 3).mean(axis=1)
        return len(pixels)

    edge = 256 if workers == 1 else max(BLOCK * 4, min(256, _rounded((width * height / (4 * workers)) ** 0.5)))
    share = 0.5 if antialias > 0 else 1.0
    _in_tiles(tile, _tiles(width, height, edge), width * height, workers, lambda part: progress(share * part))
    rough = np.zeros((0, 2), np.int64)
    if antialias > 0:
        rough = _rough(light, thing, antialias)
        step = max(BLOCK * BLOCK, min(1 << 13, len(rough) // (4 * workers) + 1))
        pieces = [rough[a : a + step] for a in range(0, len(rough), step)]
        _in_tiles(refine, pieces, len(rough), workers, lambda part: progress(share + (1 - share) * part))
    progress(1.0)
    return TracedPicture(light, distance, thing, len(rough))


def _rounded(edge: float) -> int:
    return int(edge) // BLOCK * BLOCK


def _tiles(width: int, height: int, edge: int) -> list[Box]:
    """x0, y0, x1, y1 of every tile."""
    return [(x, y, min(x + edge, width), min(y + edge, height)) for y in range(0, height, edge) for x in range(0, width, edge)]


def _blocked(box: Box) -> I64:
    """The pixels of a rectangle, block of BLOCK x BLOCK after block."""
    x0, y0, width, height = box[0], box[1], box[2] - box[0], box[3] - box[1]
    y, x = np.mgrid[:height, :width].reshape(2, -1)
    across = -(-width // BLOCK)
    order = np.argsort((y // BLOCK * across + x // BLOCK) * BLOCK * BLOCK + y % BLOCK * BLOCK + x % BLOCK)
    return np.stack([x[order] + x0, y[order] + y0], axis=1)


def _rough(light: NDArray[np.float32], thing: NDArray[np.int8], most: float) -> I64:
    """The pixels (n, 2) that differ by more than `most` from one beside them, or see another thing, block after block."""
    shown = np.minimum(light, 1.0)
    differs = np.zeros(thing.shape, bool)
    for axis in range(2):
        step = np.abs(np.diff(shown, axis=axis)).max(axis=2) > most
        step |= np.diff(thing, axis=axis) != 0
        low, high = [slice(None), slice(None)], [slice(None), slice(None)]
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        differs[tuple(low)] |= step
        differs[tuple(high)] |= step
    pixels = _blocked((0, 0, thing.shape[1], thing.shape[0]))
    return pixels[differs[pixels[:, 1], pixels[:, 0]]]


def _in_tiles(run: Callable[[Any], int], tiles: Iterable[Any], total: int, workers: int, progress: Callable[[float], None]) -> None:
    done = 0
    if workers == 1:
        for piece in tiles:
            done += run(piece)
            progress(done / total)
        return
    with ThreadPoolExecutor(workers) as pool:
        try:
            for future in as_completed([pool.submit(run, piece) for piece in tiles]):
                done += future.result()
                progress(done / total)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise

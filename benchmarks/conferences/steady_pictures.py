"""Whether pictures stay as quick as they are, and memory as small: three built-in people at the table, drawn over and over.

    python -m benchmarks.conferences.steady_pictures --seconds 600

Processor time of the drawing process is counted, which other work on the machine disturbs little.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil

from docs.pictures.conferences.scenes import choreographed
from vistel.render.scene_renderer import SceneRenderer

ROOT = Path(__file__).resolve().parents[2]
WARM = 30
"""Pictures drawn first, not counted."""
PERIOD_NS = 33_333_333


def main() -> int:
    """Draws for so long and says what it took; 1 where a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    seconds: float = parser.parse_args().seconds
    file = ROOT / "vistel" / "conference" / "demo.toml"
    moments = [choreographed(file, 0, 6.0 + 0.1 * k) for k in range(20)]
    # As in a conference, where things stay the same ones from picture to picture and nothing is made anew of them.
    instants = [replace(m.instant, things=moments[0].instant.things) for m in moments]
    studio = SceneRenderer(replace(moments[0].view, width=640, height=360), moments[0].seats)
    process = psutil.Process()
    took: list[float] = []
    memory: list[int] = []
    try:
        while not studio.complete or len(took) < WARM:
            took.append(_drawn(studio, instants[len(took) % 20], len(took)))
        took.clear()
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            took.append(_drawn(studio, instants[len(took) % 20], WARM + len(took)))
            if len(took) % 50 == 1:
                memory.append(process.memory_info().rss)
    finally:
        studio.close()
    half, p99 = np.percentile(took, (50, 99))
    quarter = max(1, len(memory) // 4)
    grown = (np.median(memory[-quarter:]) - np.median(memory[:quarter])) / 2**20
    print(f"{len(took)} pictures in {seconds:.0f} s: {1e3 * half:.1f} ms of processor each, p99 {p99 / half:.2f} times that")
    print(f"memory: {memory[-1] / 2**20:.0f} MB, {grown:+.1f} MB from the first quarter to the last")
    return 0 if p99 <= 1.5 * half and grown < 8.0 else 1


def _drawn(studio: SceneRenderer, instant: object, number: int) -> float:
    before = time.process_time()
    studio.render(replace(instant, now_ns=(number + 1) * PERIOD_NS))  # type: ignore[type-var]
    return time.process_time() - before


if __name__ == "__main__":
    sys.exit(main())

"""Pictures of the ray tracer: the example scene, the scenes of Table 1 as implicit surfaces and as polyhedra.

python -m docs.pictures.fields.trace            writes trace.png and trace-table1.png beside this file
"""

from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.fields.trace_scenes import table1
from vistel.implicit.scene import Scene, encoded, load, write_png
from vistel.implicit.trace import render

TILE = 210
OUT = Path(__file__).parent
ROOT = OUT.parents[2]


def small(scene: Scene) -> np.ndarray:
    """A tile of the table, the object as large as it gets."""
    light = render(scene, size=(2 * TILE, 2 * TILE), antialias=0.1).light
    quarter = TILE * 2 // 5
    middle = light[quarter // 2 : -quarter // 2, quarter // 2 : -quarter // 2]
    picture = Image.fromarray(encoded(middle)).resize((TILE, TILE), Image.Resampling.LANCZOS)
    return np.asarray(picture)


if __name__ == "__main__":
    write_png(OUT / "trace.png", render(load(ROOT / "examples/scenes/blobs.toml"), size=(960, 600), antialias=0.05).light)
    rows = table1()
    sheets = [np.hstack([small(r.scene(implicit)) for r in part]) for part in (rows[:4], rows[4:]) for implicit in (True, False)]
    Image.fromarray(np.vstack(sheets)).save(OUT / "trace-table1.png", optimize=True)

"""Draws assembled.png: scanned parts, what `vistel avatar assemble` makes of them, and an elbow close up.

    python -m docs.pictures.people.assembled [--out FOLDER]

Needs an OpenGL context (EGL without a display; software is fine) and a minute.
"""

import argparse
import logging
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from docs.pictures.drawing.mesh_render import Part, Studio, normals
from vistel.figure.making.assembly.assemble import assemble
from vistel.figure.making.assembly.file import read_assembly
from vistel.figure.making.files.read import read_source
from vistel.figure.making.source import SourceMesh

ROOT = Path(__file__).resolve().parents[3]
log = logging.getLogger("pictures")
KEPT, MADE = (0.45, 0.6, 0.85), (0.95, 0.62, 0.3)


def parts_of(source: SourceMesh, points: np.ndarray) -> list[Part]:
    """A source's faces, one part for each material."""
    whole = normals(points, source.triangles)
    out: list[Part] = []
    for m, material in enumerate(source.materials):
        rows = np.flatnonzero(source.material == m)
        if not len(rows):
            continue
        corner = source.triangles[rows].ravel()
        uv = source.uv[np.maximum(source.uv_triangles[rows], 0)].reshape(-1, 2).astype(np.float32)
        picture = material.picture if material.picture is not None else np.full((1, 1, 3), material.colour or 180, np.uint8)
        out.append(Part(points[corner], whole[corner], uv, np.arange(len(corner)).reshape(-1, 3), picture))
    return out


def by_kind(source: SourceMesh) -> list[Part]:
    """The same with kept polygons in blue and new ones in orange."""
    made = np.array([g.startswith("seam of") for g in source.groups])[source.group]
    return [
        Part.plain(source.points, source.triangles[rows], colour) for rows, colour in ((~made, KEPT), (made, MADE)) if rows.any()
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    args = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, ROOT / "examples/avatars/scan_parts.py", folder], check=True, stdout=subprocess.DEVNULL)
        path = Path(folder) / "parts.toml"
        before: list[Part] = []
        for part in read_assembly(path).parts:
            source = read_source(path.parent / part.file)
            before += parts_of(source, part.placed(source.points, 1.0))
        after = assemble(path, step=log.info).source
    studio = Studio()
    # The first person's left elbow is at (0.455, 1.37, 0).
    elbow = np.array((0.455, 1.365, 0.0))
    whole = (np.array((0.7, 1.15, 3.3)), np.array((0.0, 0.88, 0.0)), 0.56)
    close = (elbow + np.array((0.06, 0.14, 0.42)), elbow, 0.44)
    views = [
        (before, whole, (500, 480)),
        (parts_of(after, after.points), whole, (500, 480)),
        (before, close, (280, 480)),
        (parts_of(after, after.points), close, (280, 480)),
        (by_kind(after), close, (280, 480)),
    ]
    shots = [np.asarray(studio.photograph(parts, eye, target, size, angle)) for parts, (eye, target, angle), size in views]
    shots = [np.pad(shot, ((0, 0), (0, 6), (0, 0)), constant_values=255) for shot in shots]
    out = args.out / "assembled.png"
    Image.fromarray(np.concatenate(shots, axis=1)).save(out)
    log.info("%s", out)


if __name__ == "__main__":
    main()

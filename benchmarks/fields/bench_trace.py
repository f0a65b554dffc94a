"""Ray tracing beside POV-Ray's blobs of the same scenes, and beside the same polygons without a field.

Against POV-Ray: processor time of its trace less that of the empty scene, ours of the whole picture (camera, hits, lamps,
pixels), one thread each, in turn, medians; the share of pixels in which both see the object or both do not. The scenes
and the script that runs POV-Ray are the peers' (VISTEL_PEERS, VISTEL_PEER_PYTHON). The rows of Singh's Table 1 are scenes
of our own with as many primitives and polygons, 400 x 400, shadows, mirrors to depth 3, adaptive antialiasing, against
the same primitives as plain polyhedra in the same ray tracer.
"""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import vistel.implicit as vi
from benchmarks.fields.trace_scenes import CAMERA, table1
from benchmarks.row import Row, at_least, ratio_at_most
from vistel.implicit.scene import Light, Material, Scene
from vistel.implicit.trace import TracedPicture, Tracer, render

SCENES = ("s106", "s13c30")
SIZES = (400, 1600)
ROUNDS = 3
POVRAY, POLYHEDRA, EQUAL = ratio_at_most(0.25), ratio_at_most(1.24), at_least(99.9)


def run() -> Iterator[Row]:
    yield from against_povray()
    yield from against_polyhedra()


def against_povray() -> Iterator[Row]:
    """The blob scenes beside POV-Ray; nothing, with a line on standard error, where it is absent."""
    peers = Path(os.environ.get("VISTEL_PEERS", Path(__file__).parents[3] / "shared" / "peers"))
    if not (peers / "povray_blob.py").is_file() or shutil.which("povray") is None:
        print("bench trace: povray or the peers' scripts (VISTEL_PEERS) are absent; passed over", file=sys.stderr)
        return
    said = subprocess.run(["povray", "--version"], capture_output=True, text=True, check=False)
    version = next(line for line in (said.stderr + said.stdout).splitlines() if line.startswith("POV-Ray"))
    for name in SCENES:
        shape = blob_scene(peers, name)
        for size in SIZES:
            for shadows in (False, True):
                scene = Scene(CAMERA, shape, lights=[Light((10, 20, 5))], size=(size, size))
                ours: list[float] = []
                theirs: list[float] = []
                equal = 0.0
                timed(scene, shadows=shadows)
                for _ in range(ROUNDS):
                    spent, picture = timed(scene, shadows=shadows)
                    ours.append(spent)
                    net, hits = povray(peers, name, size, shadows)
                    theirs.append(net)
                    equal = 100.0 * float(np.mean(hits == (picture.thing > 0)))
                mine, other = median(ours), median(theirs)
                case = f"{name}, {size} x {size}, shadows {'on' if shadows else 'off'}"
                yield Row("trace", case, "processor time of a picture", "ms", 1e3 * mine, version, 1e3 * other, target=POVRAY)
                yield Row("trace", case, "pixels where both hit or both miss", "%", equal, version, target=EQUAL)


def against_polyhedra() -> Iterator[Row]:
    """The rows of Table 1; the field is compiled beforehand, intersection boxes are found within the time measured."""
    peer = "the same primitives as plain polyhedra"
    for row in table1():
        scenes = [row.scene(implicit=True), row.scene(implicit=False)]
        options: dict[str, Any] = {"antialias": 0.1, "depth": 3}
        for scene in scenes:
            timed(scene, **options)
        spent: list[list[float]] = [[], []]
        for _ in range(ROUNDS):
            for times, scene in zip(spent, scenes, strict=True):
                times.append(timed(scene, **options)[0])
        ours, theirs = median(spent[0]), median(spent[1])
        exact = Tracer(scenes[0]).exact
        candidates = exact.candidates if exact else row.polygons
        case = f"like Table 1, figure {row.figure}: {row.primitives} primitives, {row.polygons} polygons, {row.complexity}"
        yield Row("trace", case, "processor time of a picture", "ms", 1e3 * ours, peer, 1e3 * theirs, target=POLYHEDRA)
        yield Row("trace", case, "candidate polygons", "", float(candidates))


def timed(scene: Scene, **options: Any) -> tuple[float, TracedPicture]:
    """Processor time [s] of a picture on one thread, and the picture."""
    _ = scene.program
    began = time.process_time()
    picture = render(scene, threads=1, **options)
    return time.process_time() - began, picture


def blob_scene(peers: Path, name: str) -> vi.Shape:
    """A scene of the peers as a shape."""
    spec = importlib.util.spec_from_file_location("peer_scenes", peers / "scenes.py")
    assert spec is not None and spec.loader is not None
    scenes = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(scenes)
    spheres, capsules = scenes.scene(name)
    parts: list[vi.Shape] = [vi.Sphere(c, r, weight=w) for c, r, w in spheres]
    parts += [vi.Sphylinder(a, b, r, weight=w) for a, b, r, w in capsules]
    return Material((0.8, 0.5, 0.4)).on(vi.total(*parts))


def povray(peers: Path, name: str, size: int, shadows: bool) -> tuple[float, np.ndarray]:
    """POV-Ray's net trace time [s] and the pixels (size, size) in which it sees the object."""
    from PIL import Image  # comes with the renderer

    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "p.png"
        command = [
            os.environ.get("VISTEL_PEER_PYTHON", sys.executable),
            str(peers / "povray_blob.py"),
            "--scene",
            name,
            "--size",
            str(size),
            "--threads",
            "1",
            "--repeat",
            "1",
            "--keep",
            str(picture),
        ]
        done = subprocess.run([*command, *(["--shadows"] if shadows else [])], capture_output=True, text=True, check=True)
        found = json.loads(done.stdout.splitlines()[-1])
        pixels = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    net = max(found["trace_cpu_s"] - found["empty_trace_cpu_s"], 1e-3)
    # Its coordinates are left-handed: the picture is ours in a mirror.
    return net, (pixels != pixels[0, 0]).any(axis=2)[:, ::-1]

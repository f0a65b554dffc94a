"""Meshes from fields beside VTK, scikit-image and Blender; and scenes like those of Singh's Table 3.

Scene s106 of the peers' scripts: 106 spheres on a shell in a metre cube, 128 points along a side. Theirs is the field by
NumPy, every primitive in its box, and then the surface; ours both in one, with normals and every vertex on the surface
(theirs are up to 1e-2 off in F). Each peer runs in a program of its own (`benchmarks/fields/polygonise_peers.py`, with
VISTEL_PEER_PYTHON as interpreter and the scenes of VISTEL_PEERS) just after ours, several rounds in turn; processor time
of the one thread, medians. Peers that are absent are passed over.
"""

import importlib.util
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import vistel.implicit as vi
from benchmarks.row import Row, at_most, ratio_at_most
from vistel.implicit.polygonise import Lattice, Polygonisation, SurfaceMesh, polygonise
from vistel.implicit.polygonise.retained import Retained

ROUNDS, REPEATS, SIDE = 5, 15, 128
RESIDUAL = 1e-4
PEERS = {"flying_edges": ratio_at_most(0.6), "scikit_image": ratio_at_most(0.2), "blender": ratio_at_most(0.15)}
"""Peers of `polygonise_peers.py`, and what our time should be of theirs at most."""


_row = partial(Row, "polygonise")


def _took(call: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median processor time of this thread [ms]."""
    times: list[float] = []
    for _ in range(repeats):
        begin = time.thread_time_ns()
        call()
        times.append(1e-6 * (time.thread_time_ns() - begin))
    return median(times)


def run() -> Iterator[Row]:
    """All rows; about a minute."""
    os.environ["OMP_NUM_THREADS"] = "1"
    yield from _against_peers()
    yield from _updates()
    yield from _tolerances()
    yield from _table_3()


def _folder() -> Path:
    return Path(os.environ.get("VISTEL_PEERS", Path(__file__).parents[3] / "shared" / "peers"))


def _scene(name: str) -> vi.FieldProgram | None:
    """A scene of the peers' script, None where it is absent."""
    folder = _folder()
    if not (folder / "scenes.py").is_file():
        return None
    spec = importlib.util.spec_from_file_location("peer_scenes", folder / "scenes.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    balls, capsules = module.scene(name)
    shapes: list[vi.Shape] = [vi.Sphere(tuple(c), r, weight=w) for c, r, w in balls]
    shapes += [vi.Sphylinder(tuple(a), tuple(b), r, weight=w) for a, b, r, w in capsules]
    return vi.compile(vi.total(*shapes))


def _against_peers() -> Iterator[Row]:
    for name in ("s106", "s13c30"):
        program = _scene(name)
        if program is None:
            print("bench polygonise: the peers' scripts are absent (VISTEL_PEERS); passed over", file=sys.stderr)
            return
        lattice = Lattice(np.full(3, -0.75), 1.5 / (SIDE - 1))

        def ours(program: vi.FieldProgram = program, lattice: Lattice = lattice) -> SurfaceMesh:
            return polygonise(program, lattice=lattice, residual=RESIDUAL)

        mesh = ours()
        off = float(np.abs(program.shape.field(mesh.vertices) - 0.5).max())
        if not (mesh.watertight and mesh.manifold):
            raise RuntimeError(f"{name} is not closed")
        times: dict[str, list[float]] = {}
        labels: dict[str, str] = {}
        mine: list[float] = []
        for _ in range(ROUNDS):
            for which in PEERS:
                mine.append(_took(ours))
                result = _peer(name, which)
                if result:
                    times.setdefault(which, []).append(result["ms"])
                    labels[which] = result["name"]
        case = f"{name} at {SIDE}^3, {len(mesh.triangles)} triangles"
        yield _row(case, "largest |F - T| at a vertex", "1", off, target=at_most(RESIDUAL))
        value = median(mine)
        if not times:
            yield _row(case, "field and mesh", "ms", value)
        for which, most in PEERS.items():
            if which in times:
                theirs = median(times[which])
                target = most if name == "s106" else None
                yield _row(case, "field and mesh", "ms", value, labels[which], theirs, target=target)


def _peer(scene: str, which: str) -> dict[str, Any] | None:
    """What a peer's pipeline took, None where it or its packages are absent."""
    done = subprocess.run(
        [
            os.environ.get("VISTEL_PEER_PYTHON", sys.executable),
            str(Path(__file__).with_name("polygonise_peers.py")),
            str(_folder()),
            scene,
            str(SIDE),
            which,
        ],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    return json.loads(lines[-1]) if lines else None  # some fall over when they end, after the result


def _shell(count: int, size: float) -> list[vi.Shape]:
    """Balls on a shell in a metre cube."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    around = np.pi * (3 - np.sqrt(5)) * k
    ring = np.sqrt(1 - z * z)
    places = 0.4 * np.stack([ring * np.cos(around), z, ring * np.sin(around)], axis=1)
    return [vi.Sphere(tuple(c), size) for c in places]


def _updates() -> Iterator[Row]:
    side = 2 * SIDE
    solid = vi.Pointblob.of_surface(vi.sphere_mesh(0.11, 14, 22), (0, 0, 0))
    scenes: tuple[tuple[str, list[vi.Shape], int], ...] = (
        ("106 balls", _shell(106, 0.135), side),
        ("30 polyhedral primitives of 308 polygons", [solid.moved(b.bounds.mean(axis=0)) for b in _shell(30, 0.2)], SIDE),
    )
    for name, shapes, n in scenes:
        lattice = Lattice(np.full(3, -0.75), 1.5 / (n - 1))
        first = Polygonisation.of(vi.total(*shapes), lattice=lattice)
        program = vi.compile(vi.total(shapes[0].moved((0.01, 0.0, 0.0)), *shapes[1:]))
        fresh = _took(lambda p=program, g=lattice: Polygonisation.of(p, lattice=g), 5)
        took = _took(lambda f=first, p=program: f.update(p), 5)
        yield _row(f"{name} at {n}^3, one moved", "update", "ms", took, "a fresh start", fresh)


def _tolerances() -> Iterator[Row]:
    program = vi.compile(vi.total(*_shell(106, 0.135)))
    for tolerance in (0.002, 0.0005):
        mesh = polygonise(program, tolerance=tolerance)
        middle = mesh.vertices[mesh.triangles].mean(axis=1)
        field, slope = program.field_and_gradient(middle)
        off = np.abs(field - 0.5) / np.maximum(np.linalg.norm(slope, axis=1), 1e-9)
        case = f"106 balls within {1e3 * tolerance:g} mm, {len(mesh.triangles)} triangles"
        yield _row(case, "time", "ms", _took(lambda t=tolerance: polygonise(program, tolerance=t), 3))
        worst = float(off.max())
        yield _row(case, "farthest middle of a triangle", "mm", 1e3 * worst, target=at_most(1e3 * tolerance))


def table_3() -> dict[str, tuple[vi.Shape, int]]:
    """Scenes with the numbers of primitives and polygons of Singh's table 3, and the resolution of each."""
    cuboid = vi.Pointblob.of_surface(vi.box((0.55, 0.3, 0.3)), (0, 0, 0))
    ball = vi.Pointblob.of_surface(vi.sphere_mesh(0.42, 10, 20), (0, 0, 0))
    skull = vi.Pointblob.of_surface(vi.sphere_mesh(0.5, 36, 60), (0, 0, 0))
    ears = [vi.Pointblob.of_surface(vi.sphere_mesh(0.22, 9, 18), (0, 0, 0)).moved((s * 0.62, 0.52, 0)) for s in (-1, 1)]
    upper = vi.PointSetblob(_limb(0.9, 0.16, 0.13, 23, 23), [(0.2, 0, 0), (0.45, 0, 0), (0.7, 0, 0)])
    lower = vi.PointSetblob(_limb(0.8, 0.13, 0.09, 23, 23), [(0.2, 0, 0), (0.4, 0, 0), (0.6, 0, 0)])
    elbow = vi.Sphere((0.93, 0, 0), 0.2)
    cubes = [vi.Pointblob.of_surface(vi.box(0.2), (0, 0, 0)).moved(0.42 * np.array(d)) for d in _SIX]
    torus = vi.torus_mesh(0.5, 0.16, 8, 4)
    shape_change = vi.Polyblob(torus.scaled(1.5), vi.box(0.08, (0.75, 0, 0)))
    return {
        "28a: cuboid and ball": (cuboid.moved((-0.55, 0, 0)) + ball.moved((0.45, 0.1, 0)), 24),
        "28b: skull with ears": (skull + ears[0] + ears[1], 32),
        "28c: arm": (upper + elbow + lower.moved((0.95, 0, 0), (0, 0, 0.35, 1)), 32),
        "29: six cubes": (vi.total(*cubes), 40),
        "70: polyblob": (shape_change, 64),
    }


_SIX = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]


def _limb(length: float, start: float, stop: float, around: int, along: int) -> vi.Polyhedron:
    """A limb along x: rings of many sides from one radius to another."""
    turn = 2 * np.pi * np.arange(around) / around
    rings: list[Any] = []
    for k in range(along + 1):
        s = k / along
        r = (start + (stop - start) * s) * (0.75 + 0.25 * np.sin(np.pi * s))
        rings.append(np.column_stack([np.full(around, s * length), r * np.cos(turn), r * np.sin(turn)]))
    faces: list[tuple[int, ...]] = [tuple(range(around))[::-1], tuple(range(along * around, (along + 1) * around))]
    for k in range(along):
        for i in range(around):
            a, b = k * around + i, k * around + (i + 1) % around
            faces.append((a, b, b + around, a + around))
    return vi.Polyhedron(np.concatenate(rings), tuple(faces))


def _table_3() -> Iterator[Row]:
    for name, (shape, resolution) in table_3().items():
        program = vi.compile(shape)
        lattice = Lattice.over(program.bounds, resolution)
        keep = not name.startswith(("29", "70"))
        if keep:
            first = _took(lambda p=program, g=lattice: Retained(p, g, 0.5, RESIDUAL / 2, None), 5)
            made = Retained(program, lattice, 0.5, RESIDUAL / 2, None)
            rest = _took(made.mesh, 5)
            mesh, total = made.mesh(), sum(len(s.owner.surface.faces) for s in made.solids)
            yield _row(name, "primitives", "1", len(program.arrays["leaf"]))
            yield _row(name, "polygons", "1", total)
            yield _row(name, "candidate polygons", "1", made.candidates)
            yield _row(name, "polygons retained", "1", mesh.retained)
            yield _row(name, "polygons generated", "1", len(mesh.polygons) - mesh.retained)
            yield _row(name, "boxes and clipping", "ms", first)
        else:
            mesh = polygonise(program, lattice=lattice)
            yield _row(name, "primitives", "1", len(program.arrays["leaf"]))
            yield _row(name, "polygons generated", "1", len(mesh.triangles))
            rest = _took(lambda p=program, g=lattice: polygonise(p, lattice=g), 5)
        yield _row(name, "polygonising", "ms", rest)
        if not (mesh.watertight and mesh.manifold):
            raise RuntimeError(f"{name} is not closed")

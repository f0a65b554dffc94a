"""Five scenes with the make-up of Singh's Table 2: as many spheres, sphylinders, cone-spheres and rounded polygons each,
in about a metre cube at the origin, seen from (5, 5, 5) at 10 degrees, 400 x 400 pixels."""

import math
from dataclasses import dataclass

import numpy as np

import vistel.implicit as vi
from benchmarks.fields.bench_field import scene as field_scene
from vistel.implicit.scene import Camera, Light, Material, Scene

Vec3 = tuple[float, float, float]
CAMERA = Camera((5.0, 5.0, 5.0), field_of_view=math.radians(10))
LIGHTS = (Light((10, 20, 5)), Light((-5, 8, 15), colour=(0.3, 0.3, 0.35)))
CLAY = Material((0.8, 0.45, 0.32))


@dataclass(frozen=True)
class ScanlineCase:
    """figure: of the dissertation; name: ours; counts: spheres, sphylinders, cone-spheres, rounded polygons;
    seconds: scanline and ray casting on the SUN IPX of Table 2."""

    figure: str
    name: str
    counts: tuple[int, int, int, int]
    seconds: tuple[int, int]
    primitives: tuple[vi.Primitive, ...]

    @property
    def scene(self) -> Scene:
        """The primitives' sum."""
        return Scene(CAMERA, CLAY.on(vi.total(*self.primitives)), lights=LIGHTS, size=(400, 400))


def table2() -> list[ScanlineCase]:
    """The rows in the table's order."""
    made = [
        ("35", "molecule", (58, 387), molecule()),
        ("34", "shell of spheres", (75, 428), field_scene("s106")),
        ("34'", "shell of sphylinders", (66, 415), field_scene("s13c30")),
        ("31", "mannequin", (45, 304), mannequin()),
        ("37", "stool", (28, 275), stool()),
    ]
    kinds = (vi.Sphere, vi.Sphylinder, vi.ConeSphere, vi.RoundedPolygon)
    rows: list[ScanlineCase] = []
    for figure, name, seconds, primitives in made:
        a, b, c, d = (sum(type(p) is kind for p in primitives) for kind in kinds)
        rows.append(ScanlineCase(figure, name, (a, b, c, d), seconds, tuple(primitives)))
    return rows


def molecule() -> list[vi.Primitive]:
    """16 atoms on a double spiral and 20 bonds: along both strands, and rungs between them."""
    atoms: list[np.ndarray] = []
    for k in range(8):
        turn, height = 0.75 * k, -0.42 + 0.12 * k
        for strand in (0.0, math.pi):
            atoms.append(np.array([0.3 * math.cos(turn + strand), height, 0.3 * math.sin(turn + strand)]))
    bonds = [(i, i + 2) for i in range(14)] + [(2 * k, 2 * k + 1) for k in range(1, 7)]
    balls: list[vi.Primitive] = [vi.Sphere.of_surface(_point(a), 0.075) for a in atoms]
    return balls + [vi.Sphylinder.of_surface(_point(atoms[a]), _point(atoms[b]), 0.035) for a, b in bonds]


def mannequin() -> list[vi.Primitive]:
    """A figure of 2 spheres, 20 sphylinders (four fingers and a thumb to each hand, arms, shins, feet, spine) and 4
    cone-spheres (thighs, chest, neck)."""
    bones: list[tuple[Vec3, Vec3, float]] = []
    tapered: list[tuple[Vec3, Vec3, float, float]] = [
        ((0, -0.02, 0), (0, 0.16, 0), 0.09, 0.12),
        ((0, 0.2, 0), (0, 0.3, 0), 0.06, 0.04),
    ]
    for side in (-1.0, 1.0):
        bones += [
            ((0.13 * side, 0.18, 0), (0.28 * side, 0.08, 0.02), 0.04),
            ((0.28 * side, 0.08, 0.02), (0.38 * side, 0.2, 0.08), 0.034),
            ((0.11 * side, -0.27, 0.03), (0.12 * side, -0.46, 0.0), 0.04),
            ((0.12 * side, -0.48, 0.0), (0.13 * side, -0.48, 0.1), 0.034),
        ]
        for k in range(5):
            spread = 0.9 * (k - 2)
            tip = (0.41 * side + 0.06 * side * math.cos(spread), 0.25 + 0.05 * math.cos(spread), 0.09 + 0.05 * math.sin(spread))
            bones.append(((0.39 * side, 0.215, 0.085), tip, 0.016))
        tapered.append(((0.07 * side, -0.06, 0.0), (0.11 * side, -0.26, 0.03), 0.075, 0.045))
    bones += [((-0.07, -0.05, 0), (0.07, -0.05, 0), 0.07), ((-0.11, 0.18, 0), (0.11, 0.18, 0), 0.05)]
    parts: list[vi.Primitive] = [vi.Sphere.of_surface((0, 0.38, 0.01), 0.1), vi.Sphere.of_surface((0, 0.05, 0.05), 0.08)]
    parts += [vi.Sphylinder.of_surface(a, b, r) for a, b, r in bones]
    return parts + [vi.ConeSphere.of_surface(a, b, r, q) for a, b, r, q in tapered]


def stool() -> list[vi.Primitive]:
    """A seat with a back and a step (3 rounded polygons) on 3 legs, with 2 arms and 4 knobs."""
    seat = np.array([[-0.26, 0.0, -0.22], [-0.26, 0.0, 0.26], [0.26, 0.0, 0.26], [0.26, 0.0, -0.22]])
    back = np.array([[-0.22, 0.12, -0.26], [0.22, 0.12, -0.26], [0.14, 0.42, -0.32], [-0.14, 0.42, -0.32]])
    step = np.array([[-0.14, -0.34, 0.08], [0.14, -0.34, 0.08], [0.0, -0.34, 0.3]])
    parts: list[vi.Primitive] = [vi.Sphere.of_surface((0.26 * x, 0.16, 0.26), 0.07) for x in (-1.0, 1.0)]
    parts += [vi.Sphere.of_surface((0.16 * x, 0.46, -0.33), 0.06) for x in (-1.0, 1.0)]
    feet: tuple[Vec3, ...] = ((-0.28, -0.45, -0.24), (0.28, -0.45, -0.24), (0.0, -0.45, 0.34))
    parts += [vi.Sphylinder.of_surface((0.6 * x, -0.02, 0.6 * z), (x, y, z), 0.04) for x, y, z in feet]
    parts += [vi.ConeSphere.of_surface((0.26 * x, 0.02, -0.2), (0.27 * x, 0.14, 0.22), 0.07, 0.04) for x in (-1.0, 1.0)]
    return parts + [vi.RoundedPolygon.of_surface(p, 0.035) for p in (seat, back, step)]


def _point(p: np.ndarray) -> Vec3:
    x, y, z = (float(v) for v in p)
    return x, y, z

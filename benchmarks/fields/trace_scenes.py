"""Scenes for the ray tracer: the blob scenes of the peers, and eight with the make-up of Singh's Table 1."""

import math
from dataclasses import dataclass

import numpy as np

import vistel.implicit as vi
from vistel.implicit.graph.shape import Shape
from vistel.implicit.scene import Camera, Light, Material, Mesh, Scene, mesh_of

CLAY, JADE, SAND, SLATE = (
    Material((0.8, 0.42, 0.3), reflection=0.08),
    Material((0.35, 0.6, 0.45), reflection=0.08),
    Material((0.82, 0.7, 0.5), reflection=0.08),
    Material((0.45, 0.5, 0.62), reflection=0.08),
)
PALETTE = (CLAY, JADE, SAND, SLATE)
CAMERA = Camera((5.0, 5.0, 5.0), field_of_view=math.radians(10))
LIGHTS = (Light((10, 20, 5)), Light((-5, 8, 15), colour=(0.3, 0.3, 0.35)))


@dataclass(frozen=True)
class TraceCase:
    """A row of Table 1 remade. figure: of the dissertation; primitives, polygons: as there; shape: as implicit surfaces;
    meshes: every primitive as a polygon object of its own; camera."""

    figure: str
    primitives: int
    polygons: int
    complexity: str
    shape: Shape
    meshes: tuple[Mesh, ...]

    def scene(self, implicit: bool) -> Scene:
        """The scene as implicit surfaces or as polyhedra."""
        if implicit:
            return Scene(CAMERA, self.shape, lights=LIGHTS)
        return Scene(CAMERA, meshes=self.meshes, lights=LIGHTS)


def ball(radius: float, centre: tuple[float, float, float], rings: int, sectors: int) -> vi.Polyhedron:
    """A ball of sectors (rings - 2) quadrilaterals and 2 sectors triangles: rings * sectors polygons."""
    return vi.sphere_mesh(radius, rings, sectors, centre)


def bumpy(solid: vi.Polyhedron, about: tuple[float, float, float], height: float, waves: float) -> vi.Polyhedron:
    """A ball with hills, triangles only (polygons that are bent are not polygons): star-shaped about its centre."""
    offset = solid.vertices - np.array(about)
    unit = offset / np.linalg.norm(offset, axis=1, keepdims=True)
    grow = 1 + height * np.sin(waves * unit[:, 0]) * np.sin(waves * unit[:, 1] + 1) * np.sin(waves * unit[:, 2] + 2)
    return vi.Polyhedron(np.array(about) + offset * grow[:, None], tuple(map(tuple, solid.triangles.tolist())))


def _row(figure: str, polygons: int, complexity: str, parts: list[tuple[vi.Polyhedron, Shape]], joined: str = "sum") -> TraceCase:
    """A row of parts (polyhedron as it is without the others, primitive)."""
    shapes = [PALETTE[i % len(PALETTE)].on(shape) for i, (_, shape) in enumerate(parts)]
    meshes = tuple(mesh_of(solid, PALETTE[i % len(PALETTE)]) for i, (solid, _) in enumerate(parts))
    if joined == "sum":
        whole: Shape = vi.total(*shapes)
    else:
        pairs = [(i, i + 1) for i in range(len(shapes) - 1)]
        whole = vi.selective(shapes, pairs)
    return TraceCase(figure, len(parts), polygons, complexity, whole, meshes)


def _blob(solid: vi.Polyhedron, centre: tuple[float, float, float], **options: object) -> tuple[vi.Polyhedron, Shape]:
    return solid, vi.Pointblob.of_surface(solid, centre, **options)  # type: ignore[arg-type]


def _set(solid: vi.Polyhedron, centres: list[tuple[float, float, float]]) -> tuple[vi.Polyhedron, Shape]:
    return solid, vi.PointSetblob(solid, np.array(centres))


def table1() -> list[TraceCase]:
    """The eight rows, about as large as the dissertation's 1 x 1 x 1 objects."""
    rows = [
        _row(
            "18",
            447,
            "summation",
            [
                _blob(ball(0.3, (0, -0.12, 0), 12, 21), (0, -0.12, 0)),  # 252
                _blob(ball(0.09, (0, 0.24, 0), 9, 15), (0, 0.24, 0)),  # 135
                _blob(ball(0.12, (0.42, 0.02, 0.05), 6, 10), (0.42, 0.02, 0.05)),  # 60
            ],
        ),
        _row("30", 2236, "hierarchy", [_blob(*_bead(k)) for k in range(17)], "chain"),
        _row(
            "31",
            2484,
            "summation",
            [
                _blob(bumpy(ball(0.32, (0, -0.1, 0), 23, 34), (0, -0.1, 0), 0.05, 9), (0, -0.1, 0)),  # 1496 triangles
                _blob(ball(0.13, (-0.26, 0.28, 0.1), 19, 26), (-0.26, 0.28, 0.1)),  # 494
                _blob(ball(0.13, (0.28, 0.28, -0.08), 19, 26), (0.28, 0.28, -0.08)),  # 494
            ],
        ),
        _row(
            "32",
            12100,
            "summation",
            [
                _blob(bumpy(ball(0.3, (0, -0.22, 0.05), 56, 66), (0, -0.22, 0.05), 0.06, 11), (0, -0.22, 0.05)),  # 7260
                _blob(bumpy(ball(0.2, (0.02, 0.3, -0.02), 45, 55), (0.02, 0.3, -0.02), 0.06, 12), (0.02, 0.3, -0.02)),  # 4840
            ],
        ),
        _row(
            "20",
            2096,
            "summation",
            [
                _set(
                    ball(0.44, (0, 0, 0), 32, 34).transformed(_flat()),
                    [(0.2 * math.cos(a), 0.0, 0.2 * math.sin(a)) for a in (0.25 * math.pi + 0.5 * math.pi * np.arange(4)).tolist()],
                ),  # 1088
                *[_blob(ball(0.09, _round(k), 12, 21), _round(k)) for k in range(4)],  # 252 each
            ],
        ),
        _row(
            "33",
            2008,
            "hierarchy",
            [
                _blob(bumpy(ball(0.24, (0, -0.2, 0), 15, 22), (0, -0.2, 0), 0.06, 8), (0, -0.2, 0)),  # 616
                *[_blob(ball(0.075, _tip(k), 12, 19), _tip(k)) for k in range(5)],  # 228 each
                _blob(ball(0.1, (0.3, -0.3, 0.3), 12, 21), (0.3, -0.3, 0.3)),  # 252
            ],
        ),
        _row(
            "42",
            1062,
            "hierarchy",
            [
                _blob(ball(0.2, (-0.28, 0.1, 0), 18, 28).transformed(_long(-0.28, 0.1)), (-0.28, 0.1, 0)),  # 504
                (ball(0.13, (0, 0, 0), 3, 18), vi.Sphere.of_surface((0, 0, 0), 0.13)),  # 54
                _blob(ball(0.18, (0.28, 0.1, 0), 18, 28).transformed(_long(0.28, 0.1)), (0.28, 0.1, 0)),  # 504
            ],
            "chain",
        ),
        _row(
            "69",
            751,
            "summation",
            [
                _blob(ball(0.26, (-0.2, 0, 0), 17, 23), (-0.2, 0, 0)),  # 391
                _blob(ball(0.24, (0.14, 0.05, 0.02), 15, 23), (0.14, 0.05, 0.02)),  # 345
                _blob(vi.prism(_polygon(13, 0.17), -0.28, 0.1), (0, 0, -0.1)),  # 15
            ],
        ),
    ]
    return rows


def _flat() -> np.ndarray:
    """Flattened along y."""
    return np.diag([1.0, 0.3, 1.0, 1.0])[:3]


def _long(x: float, y: float) -> np.ndarray:
    """Stretched along x about (x, y, 0)."""
    return np.array([[1.25, 0, 0, -0.25 * x], [0, 0.75, 0, 0.25 * y], [0, 0, 0.75, 0]])


def _round(k: int) -> tuple[float, float, float]:
    a = 0.25 * math.pi + 0.5 * math.pi * k
    return (0.34 * math.cos(a), 0.16, 0.34 * math.sin(a))


def _tip(k: int) -> tuple[float, float, float]:
    a = math.pi * (0.12 + 0.19 * k)
    return (0.36 * math.cos(a), -0.18 + 0.4 * math.sin(a), 0.06 * math.sin(3 * a))


def _bead(k: int) -> tuple[vi.Polyhedron, tuple[float, float, float]]:
    """The k-th bead of a spiral; the first 16 have 132 polygons, the last 124."""
    a, r = 0.72 * k, 0.42 - 0.012 * k
    centre = (r * math.cos(a), -0.42 + 0.05 * k, r * math.sin(a))
    return ball(0.085, centre, *((11, 12) if k < 16 else (4, 31))), centre


def _polygon(n: int, radius: float) -> np.ndarray:
    a = 2 * math.pi * np.arange(n) / n
    return radius * np.stack([np.cos(a), np.sin(a)], axis=1)

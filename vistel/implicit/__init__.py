"""Implicit surfaces made of primitives <V, S, f>, blended and combined, evaluated fast.

    import vistel.implicit as vi

    arm = vi.Sphylinder((0, 0, 0), (1, 0, 0), 0.3) + vi.ConeSphere((1, 0, 0), (2, 0.4, 0), 0.3, 0.2)
    program = vi.compile(arm | vi.Sphere((2, 0.4, 0), 0.4))
    field = program.grid((-1, -1, -1), (3, 1, 1), 128)

The surface of a shape is where its field is T = 1/2. See docs/reference/implicit.md.
"""

from vistel.implicit.blend import HERMITE, QUAD2, QUARTIC, WYVILL, Blend
from vistel.implicit.checks import ShapeError
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.evaluation.program import Evaluation, FieldProgram, compile
from vistel.implicit.graph.attributes import Attributed
from vistel.implicit.graph.combine import (
    Complement,
    Diff,
    Extremum,
    Placed,
    Ricci,
    Sum,
    difference,
    intersection,
    selective,
    subtract,
    total,
    union,
)
from vistel.implicit.graph.primitive import Primitive
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.kinds import KINDS, primitive_of
from vistel.implicit.primitives.offset import ConeSphere, RoundedPolygon, Sphere, Sphylinder
from vistel.implicit.primitives.pointblob import Pointblob, PointSetblob
from vistel.implicit.primitives.polyblob import Polyblob
from vistel.implicit.primitives.polyhedron import Polyhedron, box, prism, sphere_mesh, torus_mesh
from vistel.implicit.primitives.superquadric import Superellipsoid, Supertoroid

__all__ = [
    "HERMITE",
    "KINDS",
    "QUAD2",
    "QUARTIC",
    "THRESHOLD",
    "WYVILL",
    "Attributed",
    "Blend",
    "Complement",
    "ConeSphere",
    "Diff",
    "Evaluation",
    "Extremum",
    "FieldProgram",
    "Placed",
    "PointSetblob",
    "Pointblob",
    "Polyblob",
    "Polyhedron",
    "Primitive",
    "Ricci",
    "RoundedPolygon",
    "Shape",
    "ShapeError",
    "Sphere",
    "Sphylinder",
    "Sum",
    "Superellipsoid",
    "Supertoroid",
    "box",
    "compile",
    "difference",
    "intersection",
    "primitive_of",
    "prism",
    "selective",
    "sphere_mesh",
    "subtract",
    "torus_mesh",
    "total",
    "union",
]

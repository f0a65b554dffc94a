"""Ghosts other than collisions, for meshes: constraints, fading dents and force fields as `GhostSource`s.

    held = pulled(ghosts_of(ball), constraint.pulls(ball_body, arm_body))
    figure.pose(posture, [held, blown(Directional((1, 0, 0), 0.8), box)])

They say the same as the nodes of `vistel.implicit.graph.ghost_nodes`, which fields of shapes are made of: given the same depth
of penetration, vertices lie within 2e-5 of field of the deformed shape. Where no depth is given, a mesh measures it as the
deepest vertex at rest (mathematics M3.4), about twice what two shapes have half-way between them, and rims are wider.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from vistel.implicit.checks import ShapeError, within
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation import effect_kernels as effects
from vistel.implicit.deformation.field_kernels import ROW
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.implicit.ghosts.constraint import ConstraintGhost
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.force_field import Directional, Radial, Shear
from vistel.implicit.ghosts.temporal import ContactMemory
from vistel.implicit.graph.combine import rotation_matrix


def pulled(source: GhostSource, pulls: Sequence[ConstraintGhost]) -> GhostSource:
    """A soft body's ghosts that also hold the mesh by `pulls`, those onto the mesh; several share one ghost (mathematics M4.6)."""
    if not pulls:
        return source
    if np.any(source.compliance <= 0):
        raise ShapeError("pulled: the source has rigid groups, expected compliances above 0")
    numbers = [max(p.hold for p in pulls), float(len(pulls))]
    for p in pulls:
        numbers += [*p.origin, *p.direction, 1.0 / p.radius**2, p.plateau, p.strength]
    return _with(source, effects.PULLED, numbers)


def faded(source: GhostSource, share: float) -> GhostSource:
    """A dent's ghosts, where its maker once was, of which `share` is left (0 to 1)."""
    return _with(source, effects.FADING, [within("faded", "share", share, 0.0, 1.0)])


def dents(memory: ContactMemory, maker: str, body: Deformable, primitives: PrimitiveSet, time: float) -> list[GhostSource]:
    """What a mesh remembers of a maker (`ContactMemory`), as ghosts; primitives: the maker's, in its own frame.

    body: the mesh's body, for the frame the dents are kept in; its position and rotation are where it is now.
    """
    decay = getattr(memory.materials.get(body.name), "decay", None)
    out: list[GhostSource] = []
    for dent in memory.dents.get((maker, body.name), ()):
        share = 1.0 if decay is None or dent.left is None else decay.share(time - dent.left)
        if share <= 0.0:
            continue
        there = primitives.moved(dent.pose.matrix, dent.pose.position)
        source = ghosts_of(there.moved(rotation_matrix(body.rotation), np.array(body.position)))
        out.append(source if share == 1.0 else faded(source, share))
    return out


def blown(field: Directional | Shear | Radial, box: ArrayLike) -> GhostSource:
    """A force field on what of a mesh lies in a box (2, 3) [m]. Planes and centres left open go through its middle."""
    low, high = np.asarray(box, np.float64)
    middle = (low + high) / 2
    if isinstance(field, Directional):
        if isinstance(field.strength, tuple):
            raise ShapeError("blown: strength has several coefficients, expected one for meshes")
        n = np.array(field.direction)
        plane = float(middle @ n) if field.plane is None else field.plane
        effect, numbers = effects.DIRECTIONAL, [*n, plane, field.strength]
    elif isinstance(field, Shear):
        centre = middle if field.centre is None else np.array(field.centre)
        u, v = np.array(field.along), np.array(field.across)
        effect, numbers = effects.SHEAR, [*u, float(centre @ u), *v, float(centre @ v), field.strength]
    else:
        effect, numbers = effects.RADIAL, [*field.centre, 1.0 / field.radius**2, max(field.strength, -0.49)]
    return GhostSource(
        np.zeros((0, ROW), np.float32),
        np.zeros(0, np.int32),
        np.zeros((0, 6), np.float32),
        np.zeros((0, 2), np.float32),
        np.zeros(2, np.int32),
        np.ones(1, np.float32),
        np.zeros(1, np.float32),
        effect=np.array([effect], np.int32),
        parameters=np.array([*low, *high, *numbers], np.float32),
        parameter_start=np.array([0, 6 + len(numbers)], np.int32),
    )


def _with(source: GhostSource, effect: int, numbers: Sequence[float]) -> GhostSource:
    groups = len(source.compliance)
    start = np.arange(groups + 1, dtype=np.int32) * len(numbers)
    return replace(
        source,
        effect=np.full(groups, effect, np.int32),
        parameters=np.tile(np.array(numbers, np.float32), groups),
        parameter_start=start,
    )

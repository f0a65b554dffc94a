"""Where polyhedral primitives act alone their own polygons are the surface (Singh §3.3.2, Figure 23).

A pointblob made `of_surface` W has F = T on W. Outside the boxes in which realms of two primitives of a sum overlap, W is
what is seen, and is traced as polygons; only inside these intersection boxes the field has to be solved, and only the
polygons whose cones reach into one are candidates for defining polygons there. Sums with weights above 0 are never less
than each of their primitives, so W never hides what lies behind the surface: a ray need not be solved beyond it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vistel.arrays import F64, I64, Bool
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.graph.lower import Leaf, lower
from vistel.implicit.graph.primitive import Primitive
from vistel.implicit.primitives.offset import Sphere, Sphylinder
from vistel.implicit.primitives.pointblob import Pointblob, PointSetblob
from vistel.implicit.primitives.polyhedron import Polyhedron
from vistel.implicit.scene import Material, Mesh
from vistel.implicit.trace.mesh_tree import BoxTree
from vistel.implicit.trace.pieces import sums

LEVELS = 5
"""An intersection box is cut in eight so many times, and parts where the surface cannot be are dropped."""
MOST_CELLS = 1 << 16
CLOSE = 1e-6


@dataclass(frozen=True, eq=False)
class Exact:
    """meshes: the polygons of primitives whose surfaces are kept; boxes (k, 2, 3): where the field has to be solved;
    polygons: how many the primitives have; candidates: those whose cones reach into a box; pairs: how many pairs of
    primitives have an intersection box."""

    meshes: tuple[Mesh, ...]
    boxes: F64
    polygons: int
    candidates: int
    pairs: int

    @classmethod
    def of(cls, program: FieldProgram, threshold: float) -> "Exact | None":
        """The polygons and boxes of a program; None where it is not a union of sums with weights above 0, or no
        primitive's polygons are its surface."""
        member = sums(program)
        if member is None or np.any(program.arrays["scale"][:, 0] <= 0):
            return None
        placed = [leaf for node in lower(program.shape, program.origin) for leaf in node.leaves]
        if not any(isinstance(leaf.primitive, Pointblob | PointSetblob) for leaf in placed):
            return None
        leaves = [_Placed.of(leaf, threshold) for leaf in placed]
        kept = [leaf for leaf in leaves if leaf.is_surface]
        if not kept:
            return None
        added = [[leaf for leaf, own in zip(leaves, row, strict=True) if own] for row in member]
        boxes: list[F64] = []
        reached = {id(leaf): np.zeros(leaf.count, bool) for leaf in leaves}
        pairs = 0
        for members in added:
            boxes += [_solved(leaf.box, [leaf], members, reached, threshold) for leaf in members if not leaf.is_surface]
            for a, b in _overlaps(members):
                if a.is_surface or b.is_surface:
                    both = np.stack([np.maximum(a.box[0], b.box[0]), np.minimum(a.box[1], b.box[1])])
                    cells = _solved(both, [a, b], members, reached, threshold)
                    pairs += len(cells) > 0
                    boxes.append(cells)
        faces = sum(len(set(leaf.faces.tolist())) for leaf in kept)
        candidates = sum(len(set(leaf.faces[reached[id(leaf)]].tolist())) for leaf in kept)
        solve = np.concatenate(boxes) if boxes else np.zeros((0, 2, 3))
        return cls(tuple(leaf.mesh() for leaf in kept), solve, faces, candidates, pairs)

    def tree(self) -> BoxTree:
        """The boxes, for rays to be cast at."""
        return BoxTree.of(self.boxes)


@dataclass(frozen=True, eq=False)
class _Placed:
    """A leaf in the world: its box (2, 3), whether its polygons are its surface, and the planes of its cones.

    cones: (b, m, 4, 4) of each of its b blobs and each triangle the planes (a, b, c, d) with a x + b y + c z + d >= 0 in
    its part of the realm, the last of them 1 - d(P); without polygons a capsule (7,) round the realm stands for it.
    """

    leaf: Leaf
    box: F64
    is_surface: bool
    cones: F64
    capsule: F64

    @classmethod
    def of(cls, leaf: Leaf, threshold: float) -> "_Placed":
        primitive, world = leaf.primitive, leaf.world
        corners = np.array(np.meshgrid(*primitive.bounds.T)).reshape(3, -1)
        corners = world[:, :3] @ corners + world[:, 3:]
        box = np.stack([corners.min(axis=1), corners.max(axis=1)])
        capsule = primitive.bounding_capsule.copy()
        for k in (0, 3):
            capsule[k : k + 3] = world[:, :3] @ capsule[k : k + 3] + world[:, 3]
        capsule[6] *= np.linalg.norm(world[:, :3], 2)
        blobs = _blobs(primitive)
        if not blobs:
            return cls(leaf, box, False, np.zeros((1, 0, 4, 4)), capsule)
        inverse = np.linalg.inv(np.vstack([world, [0, 0, 0, 1]]))
        cones: list[F64] = []
        is_surface = True
        for blob in blobs:
            sides = np.zeros((len(blob.fan.inverse), 4, 4))
            sides[:, :3, :3] = blob.fan.inverse
            sides[:, :3, 3] = -blob.fan.inverse @ np.array(blob.centre)
            sides[:, 3] = -blob.reach * sides[:, :3].sum(axis=1)
            sides[:, 3, 3] += 1.0
            cones.append(sides @ inverse)
            at_surface = leaf.weight * primitive.weight * float(blob.blend(blob.reach))
            is_surface &= abs(at_surface - threshold) < CLOSE
        return cls(leaf, box, is_surface, np.array(cones), capsule)

    @property
    def is_ratio(self) -> bool:
        """Whether the distance from the capsule's axis, over its radius, is d."""
        linear = self.leaf.world[:, :3]
        even = np.allclose(linear.T @ linear, np.eye(3) * np.linalg.norm(linear, 2) ** 2)
        return even and isinstance(self.leaf.primitive, Sphere | Sphylinder)

    @property
    def count(self) -> int:
        """Triangles of the polyhedron."""
        return self.cones.shape[1]

    @property
    def volume(self) -> Polyhedron:
        """The polyhedron of a blob."""
        volume = _blobs(self.leaf.primitive)[0].volume
        assert isinstance(volume, Polyhedron)
        return volume

    @property
    def faces(self) -> I64:
        """(m,) the polygon of each triangle."""
        return self.volume.triangle_face

    def mesh(self) -> Mesh:
        """The polygons with the leaf's material, which is looked up in its own frame."""
        world = self.leaf.world
        inverse = np.linalg.inv(np.vstack([world, [0, 0, 0, 1]]))[:3]
        vertices = self.volume.vertices @ world[:, :3].T + world[:, 3]
        return Mesh(vertices, self.volume.triangles, _material(self.leaf.values, inverse))


@dataclass(frozen=True, eq=False)
class _Framed:
    """A texture of a primitive's frame, looked up in the world."""

    texture: Callable[[F64], Any]
    inverse: F64

    def __call__(self, points: F64) -> F64:
        return np.asarray(self.texture(points @ self.inverse[:, :3].T + self.inverse[:, 3]), np.float64)


def _blobs(primitive: Primitive) -> tuple[Pointblob, ...]:
    """The pointblobs of a primitive whose cones tell its field: of polyhedra, star-shaped, without blends of vertices."""
    blobs = (primitive,) if isinstance(primitive, Pointblob) else ()
    if isinstance(primitive, PointSetblob):
        blobs = primitive.blobs
    plain = all(isinstance(b.volume, Polyhedron) and b.vertex_blends is None and not b.relaxed for b in blobs)
    return blobs if plain else ()


def _framed(texture: Any, inverse: F64) -> _Framed | None:
    return _Framed(texture, inverse) if callable(texture) else None


def _material(values: Mapping[str, Any], inverse: F64) -> Material:
    """The attributes of a leaf as a material."""
    colour: Any = values.get("colour", (0.8, 0.5, 0.4))
    bump: Any = values.get("bump")
    ambient, diffuse, specular, shininess, reflection = map(float, values.get("finish", Material().finish))
    return Material(
        (0.8, 0.5, 0.4) if callable(colour) else (float(colour[0]), float(colour[1]), float(colour[2])),
        ambient,
        diffuse,
        specular,
        shininess,
        reflection,
        _framed(colour, inverse),
        _framed(bump, inverse),
    )


def _overlaps(leaves: list[_Placed]) -> list[tuple[_Placed, _Placed]]:
    """Pairs of leaves whose boxes overlap."""
    if len(leaves) < 2:
        return []
    boxes = np.array([leaf.box for leaf in leaves])
    found: list[tuple[_Placed, _Placed]] = []
    for i in range(len(boxes)):
        later = slice(i + 1, None)
        meet = ((boxes[i, 0] < boxes[later, 1]) & (boxes[i, 1] > boxes[later, 0])).all(axis=1)
        found += [(leaves[i], leaves[i + 1 + j]) for j in np.flatnonzero(meet).tolist()]
    return found


def _solved(box: F64, both: list[_Placed], members: list[_Placed], reached: dict[int, Bool], threshold: float) -> F64:
    """The parts (k, 2, 3) of a box where all of `both` reach and the sum of `members` may be the threshold.

    A part that lies wholly inside the object is left out with those wholly outside: a ray from outside meets the surface
    elsewhere before it. `reached` learns which triangles of each leaf reach into the parts.
    """
    from vistel.implicit.trace.cells_kernels import refine

    near = [m for m in members if bool(((m.box[0] < box[1]) & (m.box[1] > box[0])).all())]
    of_blob = [m for m in near for _ in m.cones]
    cones = np.concatenate([m.cones.reshape(-1, 4, 4) for m in near])
    counts = [m.count for m in of_blob]
    blends = [b.blend for m in near for b in _blobs(m.leaf.primitive) or (m.leaf.primitive,)]
    cells, met = np.empty((MOST_CELLS, 6)), np.zeros(len(cones), bool)
    kept = refine(
        box.ravel(),
        cones,
        np.repeat(np.arange(len(of_blob)), counts),
        np.array([near.index(m) for m in of_blob]),
        np.array([m.capsule for m in of_blob]),
        np.array([m.count > 0 for m in of_blob]),
        np.array([m.is_ratio for m in of_blob]),
        np.array([m.leaf.weight * m.leaf.primitive.weight for m in of_blob]),
        np.array([b.code for b in blends]),
        np.array([b.warp for b in blends]),
        np.array([m in both for m in of_blob]),
        threshold,
        LEVELS,
        cells,
        met,
    )
    for leaf, flags in zip(of_blob, np.split(met, np.cumsum(counts)[:-1]), strict=True):
        reached[id(leaf)] |= flags
    return cells[:kept].reshape(-1, 2, 3)

"""What a scene is made of, in numbers, and what looks wrong with it (the columns of Singh's Table 1)."""

import numpy as np

from vistel.implicit.graph.combine import Combination, Complement, Sum
from vistel.implicit.graph.primitive import Primitive
from vistel.implicit.graph.shape import Shape
from vistel.implicit.scene import Scene
from vistel.implicit.trace.exact import Exact

LATTICE = 24


def report(scene: Scene) -> dict[str, int]:
    """primitives; polygons of the polyhedral ones; candidate_polygons: those of them that can define the field inside an
    intersection box; intersection_boxes: pairs of primitives that have one; mesh_triangles of the polygon objects."""
    program = scene.program
    facts = {"primitives": 0 if program is None else len(program.arrays["leaf"])}
    exact = None if program is None or program.far >= scene.threshold else Exact.of(program, scene.threshold)
    facts |= {
        "polygons": exact.polygons if exact else 0,
        "candidate_polygons": exact.candidates if exact else 0,
        "intersection_boxes": exact.pairs if exact else 0,
        "mesh_triangles": sum(len(m.triangles) for m in scene.meshes),
    }
    return facts


def warnings(scene: Scene) -> list[str]:
    """A line for each thing that makes an implicit surface empty."""
    if scene.shape is None or scene.program is None or scene.program.far >= scene.threshold:
        return []
    most = _most(scene.shape)
    if most < scene.threshold:
        return [
            f"the field never reaches the threshold {scene.threshold:g} (it is {most:.3g} at most), so there is no "
            "surface; raise weights or lower the threshold"
        ]
    points = [_middles(scene.program.arrays["box"]) + scene.program.origin]
    low, high = scene.program.bounds
    lattice = np.indices((LATTICE,) * 3).reshape(3, -1).T / (LATTICE - 1)
    points.append(low + lattice * (high - low))
    found = float(scene.program.field(np.concatenate(points)).max())
    if found < scene.threshold:
        return [
            f"the field is {found:.3g} at most where it was sampled, below the threshold {scene.threshold:g}: "
            "there may be no surface; raise weights or lower the threshold"
        ]
    return []


def _middles(boxes: np.ndarray) -> np.ndarray:
    return np.asarray((boxes[:, :3] + boxes[:, 3:]) / 2, np.float64)


def _most(shape: Shape) -> float:
    """A bound of the field from above, from those of the primitives."""
    bound: dict[int, tuple[float, float]] = {}
    for node in shape.walk():
        if isinstance(node, Primitive):
            bound[id(node)] = (min(node.weight, 0.0), max(node.weight, 0.0))
        elif isinstance(node, Sum):
            pairs = [(w, *bound[id(s)]) for w, s in zip(node.weights, node.shapes, strict=True)]
            bound[id(node)] = (sum(min(w * a, w * b) for w, a, b in pairs), sum(max(w * a, w * b) for w, a, b in pairs))
        elif isinstance(node, Complement):
            a, b = bound[id(node.shapes[0])]
            bound[id(node)] = (2 * node.threshold - b, 2 * node.threshold - a)
        elif isinstance(node, Combination) and type(node).__name__ in ("Extremum", "Ricci"):
            ends = np.array([bound[id(s)] for s in node.shapes]).T
            low, high = (float(node.combine(end[:, None])[0][0]) for end in np.maximum(ends, -1e9))
            bound[id(node)] = (low, high)
        elif node.operands and not isinstance(node, Combination):
            bound[id(node)] = bound[id(node.operands[0])]
        else:
            bound[id(node)] = (-np.inf, np.inf)
    return bound[id(shape)][1]

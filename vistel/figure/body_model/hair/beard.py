"""Beards: shells of short hair over the skin of jaw and lip, which move with the face."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.patch import Patch
from vistel.figure.body_model.hair.strands import cap_box, painted, strands
from vistel.figure.body_model.model import BodyModel
from vistel.figure.figure import vertex_normals
from vistel.figure.part import Part, together
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.smoothstep import smooth


@dataclass(frozen=True)
class Beard:
    """heights: of its shells [m], the lowest first; chin: how much higher they are under the chin [m]; lip: whether only the upper
    lip has one."""

    heights: tuple[float, ...]
    chin: float = 0.0
    lip: bool = False


BEARDS: dict[str, Beard | None] = {
    "none": None,
    "short_beard": Beard((0.0010, 0.0024, 0.0040), 0.002),
    "full_beard": Beard((0.0015, 0.0045, 0.0080), 0.014),
    "moustache": Beard((0.0010, 0.0024, 0.0040), lip=True),
}
"""By name."""
_CHEEK = ((0.0, 0.012, 0.028, 0.036, 0.046, 0.056, 0.064, 0.072), (0.013, 0.014, 0.012, 0.007, 0.006, 0.020, 0.044, 0.070))
"""How high a beard grows over the mouth [m], by the distance from the face's middle [m], where eyes are 65 mm over the mouth."""
_NECK = ((-0.085, -0.065, -0.030, 0.020), (0.015, -0.025, -0.052, -0.070))
"""Down to where it grows, by how far before the eyes [m]."""
_STRANDS = ((-0.010, 0.0, 0.006, 0.030), (0.0, 0.10, 0.30, 0.75))
"""Where in the picture of shells a place is, as a share of its height, by how far inside the beard's outline it is [m]."""


def beard(model: BodyModel, body: Avatar, style: str, colour: tuple[float, float, float], rng: np.random.Generator) -> Part | None:
    """A beard for a body in the T-pose, with all its levels; None for none. model: that the body was made of; style: one of
    `BEARDS`; colour: sRGB 0 to 255. Raises ValueError, one line, for a style that is not known."""
    if style not in BEARDS:
        raise ValueError(f"beard: expected one of {', '.join(BEARDS)}, got {style!r}")
    made = BEARDS[style]
    if made is None:
        return None
    levels = tuple(_level(model, made, body, level.mesh, k) for k, level in enumerate((body, *body.coarser)))
    drawn = strands("tufts")
    patch = Patch(roughness=0.7, normal=drawn.normal, opacity=drawn.opacity, cutoff=0.35, both_sides=True)
    return Part(style, levels, painted("tufts", colour, 0.0, rng), (patch,))


def _level(model: BodyModel, style: Beard, body: Avatar, mesh: Mesh, level: int) -> Mesh:
    """Shells over a level of detail: all over the finest, the highest and the lowest over others."""
    p, normal = mesh.vertices.astype(np.float64), vertex_normals(mesh).astype(np.float64)
    lips = _sampled(model, mesh, "lips")
    mouth, eyes = p[lips > 0.5].mean(axis=0), body.skeleton.rest[JOINT_INDEX["left_eye"]]
    size = float(eyes[1] - mouth[1]) / 0.065
    at: F64 = (p - np.array((0.0, mouth[1], eyes[2]))) / size
    x, y, z = np.abs(at[:, 0]), at[:, 1], at[:, 2]
    # How far inside the beard's outline, and off the lips.
    high: F64 = np.interp(x, _CHEEK[0], _CHEEK[1])
    low: F64 = np.interp(z, _NECK[0], _NECK[1])
    within: F64 = np.minimum.reduce([high - y, y - low, z + 0.058, 0.070 - x, 0.010 * (0.6 - lips)])
    if style.lip:
        within = np.minimum.reduce([within, y + 0.002, 0.029 - x])
    within[(_sampled(model, mesh, "inside") > 0.0) | (y < -0.12)] = -1.0
    # Not within the mouth: there skin lies nearer to the middle of the head than other skin in the same direction.
    near = np.flatnonzero((within > 0.0) & (x < 0.055))
    way = at[near] + np.array((0.0, 0.0, 0.06))
    far = np.linalg.norm(way, axis=1)
    tree: Any = KDTree(way / far[:, None])
    angle, which = tree.query(way / far[:, None], k=min(12, len(near)))
    farthest = np.where(np.asarray(angle) < 0.10, far[np.asarray(which, np.int64)], 0.0).max(axis=1)
    within[near[far < farthest - 0.010]] = -1.0
    chin = smooth((-0.02 - y) / 0.03)
    tri = mesh.triangles[(within[mesh.triangles] > 0.0).any(axis=1) & (within[mesh.triangles] > -0.5).all(axis=1)]
    vertex = np.unique(tri)
    place = np.full(len(p), -1, np.int32)
    place[vertex] = np.arange(len(vertex), dtype=np.int32)
    assert mesh.bone is not None and mesh.weight is not None, "bodies of the model have bones"
    heights = style.heights if level == 0 else (style.heights[0], style.heights[-1])
    shells: list[Mesh] = []
    for k, over in enumerate(heights):
        box = cap_box(shell=k > 0)
        lift = (0.0006 + size * over + size * style.chin * chin * k / (len(style.heights) - 1.0)) * smooth((within + 0.002) / 0.015)
        # Strands run down from the cheeks, round the head side by side.
        round_head = np.abs(np.arctan2(p[:, 0], (z + 0.08) * size)) / np.pi
        v: F64 = np.interp(within, _STRANDS[0], _STRANDS[1])
        uv = box[:2] + np.column_stack([round_head, v]) * (box[2:] - box[:2])
        shells.append(
            Mesh(
                (p + lift[:, None] * normal)[vertex].astype(np.float32),
                place[tri],
                np.arange(len(vertex), dtype=np.int32),
                uv[vertex].astype(np.float32),
                place[tri],
                mesh.limb[vertex],
                mesh.bone[vertex],
                mesh.weight[vertex],
                tuple(target.of(place) for target in mesh.targets),
            )
        )
    return together(shells)


def _sampled(model: BodyModel, mesh: Mesh, name: str) -> F64:
    """(V,) a mask of the model's texture, 0 to 1, at vertices."""
    mask = model.masks[name]
    column = np.clip((mesh.uv[:, 0] * mask.shape[1]).astype(int), 0, mask.shape[1] - 1)
    row = np.clip(((1.0 - mesh.uv[:, 1]) * mask.shape[0]).astype(int), 0, mask.shape[0] - 1)
    out = np.zeros(len(mesh.vertices))
    np.maximum.at(out, mesh.corner_vertex, mask[row, column] / 255.0)
    return out

"""Meshes of hair: cards along curves, and the bones that hair follows."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.body_model.hair.scalp import Scalp
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINT_INDEX, JOINTS
from vistel.geometry.smoothstep import smooth


@dataclass(frozen=True, eq=False)
class Strips:
    """Triangles with texture coordinates: p (V, 3) [m], uv (V, 2), triangles (F, 3); no vertex is in two strips."""

    p: F64
    uv: F64
    triangles: I32


def cards(curve: F64, out: F64, at: F64, width: F64, box: F64, across: int, arch: float) -> Strips:
    """A strip along each curve (N, R, 3). out: (N, R, 3) unit, to which its face is turned; at: (R,) shares of its length, 0 at the
    root; width: (N, R) [m]; box: (N, 4) of the picture, lowest u and v, highest u and v, the root at the top (u may be the other
    way round); across: vertices across, 2 or 3; arch: height of its middle as a share of its width."""
    count, rows, _ = curve.shape
    along = np.gradient(curve, axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-9)
    side = np.cross(along, out)
    side /= np.maximum(np.linalg.norm(side, axis=2, keepdims=True), 1e-9)
    face = np.cross(side, along)
    place = np.linspace(-0.5, 0.5, across)
    p = (
        curve[:, :, None]
        + (place[:, None] * side[:, :, None] - arch * (2.0 * np.abs(place[:, None]) * face[:, :, None])) * (width[:, :, None, None])
    )
    u = box[:, None, None, 0] + (box[:, 2] - box[:, 0])[:, None, None] * (place + 0.5)
    v = box[:, None, None, 3] + (box[:, 1] - box[:, 3])[:, None, None] * at[:, None]
    uv = np.stack(np.broadcast_arrays(u, v), axis=-1)
    row, column = np.divmod(np.arange((rows - 1) * (across - 1), dtype=np.int32), np.int32(across - 1))
    first = row * np.int32(across) + column
    step = np.array(((0, 1, across), (1, across + 1, across)), np.int32)
    card = np.arange(count, dtype=np.int32) * np.int32(rows * across)
    tri = (card[:, None, None, None] + first[:, None, None] + step).reshape(-1, 3)
    return Strips(p.reshape(-1, 3), uv.reshape(-1, 2), tri)


def mesh_of(scalp: Scalp, parts: list[Strips], limb: int) -> Mesh:
    """One mesh: what is at the head follows it, what hangs lower follows more and more what it lies on."""
    start = np.cumsum([0, *(len(part.p) for part in parts)])
    p = np.concatenate([part.p for part in parts])
    tri = np.concatenate([part.triangles + s for part, s in zip(parts, start, strict=False)]).astype(np.int32)
    uv = np.concatenate([part.uv for part in parts])
    bone, weight = _weights(scalp, p)
    return Mesh(
        p.astype(np.float32),
        tri,
        np.arange(len(p), dtype=np.int32),
        uv.astype(np.float32),
        tri,
        np.full(len(p), limb, np.int32),
        bone,
        weight,
    )


def _weights(scalp: Scalp, p: F64) -> tuple[I32, F32]:
    """(V, 4) bones and their shares."""
    head, neck, spine = (JOINT_INDEX[n] for n in ("head", "neck", "spine_8"))
    top, low = scalp.eyes[1] - 0.9 * scalp.size, scalp.neck[1] - 0.6 * scalp.size
    down = (top - p[:, 1]) / (top - low)
    # What lies on neck and shoulders goes with their skin, what hangs beside it with neck and spine.
    close = smooth((0.4 * scalp.size - scalp.skin(p)[0]) / (0.25 * scalp.size)) * smooth(down / 0.35)
    of_spine = smooth((down - 0.45) / 0.75)
    of_neck = smooth(down / 0.9) * (1.0 - of_spine)
    share = np.zeros((len(p), len(JOINTS) + len(TWIST_BONES)))
    share[:, spine], share[:, neck], share[:, head] = of_spine, of_neck, 1.0 - of_neck - of_spine
    share *= 1.0 - close[:, None]
    body, lying = scalp.body.mesh, np.flatnonzero(close > 0.0)
    assert body.bone is not None and body.weight is not None, "bodies of the model have bones"
    for near in scalp.nearest(p[lying]).T:
        for bone, weight in zip(body.bone[near].T, body.weight[near].T, strict=True):
            np.add.at(share, (lying, bone), close[lying] * weight / 4.0)
    order = np.argsort(-share, axis=1, kind="stable")[:, :4]
    weight = np.take_along_axis(share, order, axis=1)
    return order.astype(np.int32), (weight / weight.sum(axis=1, keepdims=True)).astype(np.float32)

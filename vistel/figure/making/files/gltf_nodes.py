"""Nodes of a glTF scene: their places, their parents, which are drawn; and the joints of a skin's vertices."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32
from vistel.figure.making.files.gltf import Document
from vistel.figure.making.source import MakingError
from vistel.geometry.rotation import matrix_from_quaternion


class Nodes:
    """matrix: (N, 4, 4) of each node in the scene; parents: (N,), -1 for roots."""

    def __init__(self, document: Document) -> None:
        self._rows = document.rows("nodes")
        count = len(self._rows)
        self.parents = np.full(count, -1, np.int32)
        for i, row in enumerate(self._rows):
            for child in row.get("children", []):
                if not isinstance(child, int) or not 0 <= child < count or self.parents[child] >= 0:
                    raise MakingError(f"{document.path}: node {child} under node {i} is not one; export the file again")
                self.parents[child] = i
        own = [_matrix(row) for row in self._rows]
        self.matrix = np.tile(np.eye(4), (count, 1, 1))
        order = self._order(document)
        for i in order:
            p = int(self.parents[i])
            self.matrix[i] = own[i] if p < 0 else self.matrix[p] @ own[i]
        scenes = document.rows("scenes")
        shown = document.tree.get("scene", 0)
        roots = scenes[shown].get("nodes", []) if isinstance(shown, int) and 0 <= shown < len(scenes) else None
        inside = set(roots) if roots is not None else {i for i in order if self.parents[i] < 0}
        for i in order:
            if int(self.parents[i]) in inside:
                inside.add(i)
        self._drawn = [i for i in order if i in inside and "mesh" in self._rows[i]]

    def __len__(self) -> int:
        return len(self._rows)

    def name(self, node: int) -> str:
        """The name of a node, or its number where it has none."""
        return str(self._rows[node].get("name") or f"node {node}")

    def drawn(self) -> list[int]:
        """Nodes of the scene that have a mesh."""
        return self._drawn

    def _order(self, document: Document) -> list[int]:
        """Parents before children."""
        out = [i for i in range(len(self)) if self.parents[i] < 0]
        for i in out:
            out += list(self._rows[i].get("children", []))
        if len(out) != len(self):
            raise MakingError(f"{document.path}: nodes that hang on each other in a ring; export the file again")
        return out


def _matrix(row: dict[str, Any]) -> F64:
    if "matrix" in row:
        out = np.array(row["matrix"], np.float64).reshape(4, 4).T
    else:
        out = np.eye(4)
        x, y, z, w = row.get("rotation", (0.0, 0.0, 0.0, 1.0))
        q = np.array((x, y, z, w), np.float64)
        q /= max(float(np.linalg.norm(q)), 1e-12)
        out[:3, :3] = matrix_from_quaternion(q) * np.array(row.get("scale", (1.0, 1.0, 1.0)), np.float64)
        out[:3, 3] = row.get("translation", (0.0, 0.0, 0.0))
    if not np.isfinite(out).all():
        raise ValueError("a node with numbers that are not finite")
    return out


def parents_within(nodes: Nodes, chosen: Sequence[int]) -> I32:
    """(J,) place in `chosen` of the nearest node above each that is in it, -1 for none."""
    place = {node: k for k, node in enumerate(chosen)}
    out = np.full(len(chosen), -1, np.int32)
    for k, node in enumerate(chosen):
        at = int(nodes.parents[node])
        while at >= 0 and at not in place:
            at = int(nodes.parents[at])
        out[k] = place.get(at, -1)
    return out


def influences(document: Document, attributes: dict[str, int], skin: dict[str, Any], count: int) -> tuple[NDArray[np.int64], F64]:
    """(N, 4 n) places in the skin's joints and shares that sum to 1. Raises MakingError."""
    joints: list[NDArray[np.int64]] = []
    shares: list[F64] = []
    for k in range(8):
        if f"JOINTS_{k}" not in attributes or f"WEIGHTS_{k}" not in attributes:
            break
        joints.append(document.array(attributes[f"JOINTS_{k}"]).astype(np.int64))
        shares.append(document.array(attributes[f"WEIGHTS_{k}"]).astype(np.float64))
    if not joints:
        joints, shares = [np.zeros((count, 1), np.int64)], [np.ones((count, 1))]
    joint, share = np.hstack(joints), np.maximum(np.nan_to_num(np.hstack(shares)), 0.0)
    if joint.shape != share.shape or len(joint) != count or (len(joint) and joint.max() >= len(skin["joints"])):
        raise MakingError(f"{document.path}: weights that fit no joints; export the file again")
    total = share.sum(axis=1)
    share[total < 1e-6, 0] = 1.0
    return joint, share / np.maximum(share.sum(axis=1, keepdims=True), 1e-9)

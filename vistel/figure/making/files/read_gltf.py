"""A person's mesh from glTF 2.0, GLB and VRM: as the file shows it, with its rig, weights, materials and pictures."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32
from vistel.figure.making.files.expressions import joined, named, vrm_expressions
from vistel.figure.making.files.gltf import Document, read_document
from vistel.figure.making.files.gltf_materials import GltfMaterials, layout
from vistel.figure.making.files.gltf_nodes import Nodes, influences, parents_within
from vistel.figure.making.files.vrm import humanoid, version
from vistel.figure.making.source import MakingError, Rig, SourceMaterial, SourceMesh, SourceTarget

_MOST_WEIGHTS = 300_000_000
_TRIANGLES = 4
_STRIP = 5
_FAN = 6
_SEEN = 0.35
"""Mean opacity of a face in its picture, below which it is left out of a thing: things are drawn opaque."""
_ANY = 0.03
"""Opacity that some part of a face of a figure must reach, or it is left out: the renderer draws figures' opacity."""
_PLACES = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)], np.float64) / 4.0


def read_gltf(path: Path, *, apart: bool = False) -> SourceMesh:
    """The mesh of a glTF file. apart: nodes of one name are groups of their own. Raises MakingError, OSError."""
    document = read_document(path)
    try:
        return _Reader(document, apart).source()
    except (TypeError, ValueError, KeyError, AttributeError, IndexError, OverflowError) as fault:
        if isinstance(fault, MakingError):
            raise
        raise MakingError(f"{path}: not as glTF 2.0 has it ({fault}); export the file again") from fault


@dataclass
class _Part:
    """A primitive: points (N, 3), triangles (F, 3), uv (N, 2) or None, influences (N, J) or None."""

    points: F64
    triangles: I32
    uv: F64 | None
    weight: NDArray[np.float32] | None
    group: int
    material: int
    targets: Sequence[SourceTarget] = ()


class _Reader:
    def __init__(self, document: Document, apart: bool) -> None:
        self.apart = apart
        self.document, self.nodes, self.notes = document, Nodes(document), list[str]()
        self.told = humanoid(document)
        skinned = [j for skin in document.rows("skins") for j in skin.get("joints", [])]
        self.joints = sorted({j for j in (*skinned, *self.told) if isinstance(j, int) and 0 <= j < len(self.nodes)})
        self.column = {j: k for k, j in enumerate(self.joints)}
        self.groups: dict[str, int] = {}
        self._read = GltfMaterials(document, self.notes, patches=not apart)
        self.materials = [self._read.material(m) for m in document.rows("materials")]
        self.materials.append(SourceMaterial("", None, None))
        self.expressions = vrm_expressions(document)

    def source(self) -> SourceMesh:
        parts = [p for node in self.nodes.drawn() for p in self._node(node)]
        parts = [p for p in parts if len(p.triangles)]
        path = self.document.path
        if not parts:
            raise MakingError(f"{path}: no triangles; expected a glTF file with the surface of a person")
        if kind := version(self.document):
            self.notes.append(f"{kind}, humanoid map of {len(self.told)} bones")
        starts = np.cumsum([0, *(len(p.points) for p in parts)])
        points = np.vstack([p.points for p in parts])
        if not np.isfinite(points).all():
            raise MakingError(f"{path}: points that are not finite; repair the mesh")
        if len(points) * max(1, len(self.joints)) > _MOST_WEIGHTS:
            raise MakingError(f"{path}: {len(points)} vertices; reduce the mesh to at most some 100,000 first")
        triangles = np.vstack([p.triangles + start for p, start in zip(parts, starts, strict=False)]).astype(np.int32)
        if triangles.min() < 0 or triangles.max() >= len(points):
            raise MakingError(f"{path}: triangles of vertices that are not there; export the file again")
        uv = np.vstack([np.zeros((len(p.points), 2)) if p.uv is None else p.uv for p in parts])
        bare = np.concatenate([np.full(len(p.triangles), p.uv is None) for p in parts])
        counts = [len(p.triangles) for p in parts]
        return SourceMesh(
            path.stem,
            points,
            triangles,
            np.nan_to_num(uv),
            np.where(bare[:, None], np.int32(-1), triangles),
            np.repeat([p.group for p in parts], counts).astype(np.int32),
            tuple(self.groups),
            np.repeat([p.material for p in parts], counts).astype(np.int32),
            tuple(self.materials),
            self._rig(parts),
            1.0,
            "Y",
            tuple(self.notes),
            joined([(start, p.targets) for p, start in zip(parts, starts, strict=False)]),
        )

    def _rig(self, parts: Sequence[_Part]) -> Rig | None:
        if not self.joints:
            return None
        weight = None
        if any(p.weight is not None for p in parts):
            none = np.zeros(len(self.joints), np.float32)
            weight = np.vstack([np.tile(none, (len(p.points), 1)) if p.weight is None else p.weight for p in parts])
        names = tuple(str(self.nodes.name(j)) for j in self.joints)
        told = {self.column[j]: ours for j, ours in self.told.items() if j in self.column}
        at = np.array([self.nodes.matrix[j][:3, 3] for j in self.joints])
        return Rig(names, parents_within(self.nodes, self.joints), at, weight, told)

    def _node(self, node: int) -> list[_Part]:
        row = self.document.row("nodes", node)
        mesh = self.document.row("meshes", row["mesh"])
        name = str(row.get("name") or mesh.get("name") or f"mesh {row['mesh']}")
        if self.apart and name in self.groups:
            name = f"{name} ({node})"
        group = self.groups.setdefault(name, len(self.groups))
        out: list[_Part] = []
        for primitive in mesh.get("primitives", []):
            packed = [n for n in primitive.get("extensions", {}) if "compression" in n]
            if packed:
                raise MakingError(f"{self.document.path}: {name} is compressed ({packed[0]}); export it without compression")
            if primitive.get("mode", _TRIANGLES) not in (_TRIANGLES, _STRIP, _FAN):
                self.notes.append(f"{name}: lines or points left out")
                continue
            part = self._primitive(primitive, mesh, row, node, group)
            out.append(replace(part, targets=self._targets(primitive, mesh, row, node, len(part.points))))
        return out

    def _primitive(self, primitive: dict[str, Any], mesh: dict[str, Any], row: dict[str, Any], node: int, group: int) -> _Part:
        read, attributes = self.document.array, primitive["attributes"]
        points = self._columns(attributes["POSITION"], 3)
        targets, shares = primitive.get("targets", []), row.get("weights", mesh.get("weights", []))
        for target, share in zip(targets, shares, strict=False):
            if share and "POSITION" in target:
                points = points + float(share) * self._columns(target["POSITION"], 3)
        index = read(primitive["indices"])[:, 0].astype(np.int64) if "indices" in primitive else np.arange(len(points))
        triangles = _triangles(index, primitive.get("mode", _TRIANGLES))
        if len(triangles) and triangles.max() >= len(points):
            raise MakingError(f"{self.document.path}: triangles of vertices that are not there; export the file again")
        if "skin" in row:
            skin = self.document.row("skins", row["skin"])
            points, weight = self._skinned(points, attributes, skin)
        else:
            matrix = self.nodes.matrix[node]
            points = points @ matrix[:3, :3].T + matrix[:3, 3]
            if np.linalg.det(matrix[:3, :3]) < 0.0:
                triangles = triangles[:, ::-1]
            weight = self._rigid(node, len(points))
        material = primitive.get("material", len(self.materials) - 1)
        if not isinstance(material, int) or not 0 <= material < len(self.materials):
            raise MakingError(f"{self.document.path}: a material that is not there; export the file again")
        uv = self._uv(attributes, material)
        triangles = self._seen(triangles, uv, material)
        return _Part(points, triangles.astype(np.int32), uv, weight, group, material)

    def _targets(
        self, primitive: dict[str, Any], mesh: dict[str, Any], row: dict[str, Any], node: int, count: int
    ) -> list[SourceTarget]:
        """The primitive's morph targets, and expressions made of them, turned as its points are."""
        read = [self._columns(t["POSITION"], 3) if "POSITION" in t else np.zeros((count, 3)) for t in primitive.get("targets", [])]
        if any(len(offset) != count for offset in read):
            raise MakingError(f"{self.document.path}: a morph target of other vertices than its mesh; export the file again")
        if not read:
            return []
        here = (("mesh", row["mesh"]), ("node", node))
        binds = ((name, [(k, share) for on, k, share in of if on in here]) for name, of in self.expressions.items())
        found = named(mesh.get("extras", {}).get("targetNames", []), read, binds)
        if "skin" not in row:
            turn = self.nodes.matrix[node][:3, :3]
            return [replace(t, offset=t.offset @ turn.T) for t in found]
        joints, share, matrices = self._bound(primitive["attributes"], self.document.row("skins", row["skin"]), count)
        turned: list[SourceTarget] = []
        for t in found:
            turns = np.einsum("nk,nkij->nij", share[t.vertex], matrices[joints[t.vertex]][..., :3, :3])
            turned.append(replace(t, offset=np.einsum("nij,nj->ni", turns, t.offset)))
        return turned

    def _columns(self, accessor: int, columns: int) -> F64:
        out = self.document.array(accessor).astype(np.float64)
        if out.shape[1] != columns:
            raise MakingError(f"{self.document.path}: accessor {accessor} has {out.shape[1]} columns, expected {columns}")
        return out

    def _skinned(self, points: F64, attributes: dict[str, int], skin: dict[str, Any]) -> tuple[F64, NDArray[np.float32]]:
        """Points as the joints of the file stand, and their shares."""
        joints, share, matrices = self._bound(attributes, skin, len(points))
        of = np.array([self.column[j] for j in skin["joints"]])
        whole = np.column_stack([points, np.ones(len(points))])
        moved, weight = np.zeros((len(points), 3)), np.zeros((len(points), len(self.joints)), np.float32)
        rows = np.arange(len(points))
        for k in range(joints.shape[1]):
            moved += share[:, k, None] * np.einsum("nij,nj->ni", matrices[joints[:, k], :3], whole)
            np.add.at(weight, (rows, of[joints[:, k]]), share[:, k])
        return moved, weight

    def _bound(self, attributes: dict[str, int], skin: dict[str, Any], count: int) -> tuple[NDArray[np.int64], F64, F64]:
        """(count, K) joints of a skin, their shares, and (J, 4, 4) what each joint does to points of its skin."""
        joints, share = influences(self.document, attributes, skin, count)
        bind = np.tile(np.eye(4), (len(skin["joints"]), 1, 1))
        if "inverseBindMatrices" in skin:
            bind = self.document.array(skin["inverseBindMatrices"]).astype(np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
        return joints, share, np.array([self.nodes.matrix[j] @ b for j, b in zip(skin["joints"], bind, strict=True)])

    def _rigid(self, node: int, count: int) -> NDArray[np.float32] | None:
        """Shares of a mesh that is a child of a joint, as eyes and hats are."""
        at = node
        while at >= 0 and at not in self.column:
            at = int(self.nodes.parents[at])
        if at < 0:
            return None
        out = np.zeros((count, len(self.joints)), np.float32)
        out[:, self.column[at]] = 1.0
        return out

    def _uv(self, attributes: dict[str, int], material: int) -> F64 | None:
        rows = self.document.rows("materials")
        lying = self._read.lying(layout(rows[material]) if material < len(rows) else {})
        if lying.named not in attributes:
            return None
        uv = self._columns(attributes[lying.named], 2)
        return np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]) @ lying.matrix[:2, :2].T + lying.matrix[:2, 2]

    def _seen(self, triangles: NDArray[np.int64], uv: F64 | None, material: int) -> NDArray[np.int64]:
        """The triangles without those that their picture leaves transparent."""
        rows = self.document.rows("materials")
        if uv is None or material >= len(rows) or not len(triangles):
            return triangles
        alpha = self._read.alpha(rows[material])
        if alpha is None:
            return triangles
        corner = uv[triangles]
        places = np.einsum("pk,fkc->fpc", _PLACES, corner)
        x = (np.mod(places[..., 0], 1.0) * (alpha.shape[1] - 1)).astype(np.int64)
        y = ((1.0 - np.mod(places[..., 1], 1.0)) * (alpha.shape[0] - 1)).astype(np.int64)
        found = alpha[y, x]
        keep = found.mean(axis=1) >= 255 * _SEEN if self.apart else found.max(axis=1) >= 255 * _ANY
        if not keep.all():
            self.notes.append(f"material {self.materials[material].name!r}: {int((~keep).sum())} transparent faces left out")
        return triangles[keep]


def _triangles(index: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    if mode == _TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    if len(index) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == _FAN:
        return np.column_stack([np.full(len(index) - 2, index[0]), index[1:-1], index[2:]])
    strip = np.column_stack([index[:-2], index[1:-1], index[2:]])
    strip[1::2] = strip[1::2, [1, 0, 2]]
    return strip

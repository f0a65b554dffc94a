"""A person's mesh from USD made by others: meshes as the stage shows them, UsdSkel rig and weights, materials, textures."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Tf, Usd, UsdGeom, UsdSkel, Vt

from vistel.arrays import F64, I32
from vistel.figure.making.files.usd_inside import opened
from vistel.figure.making.files.usd_materials import Materials
from vistel.figure.making.source import MakingError, Rig, SourceMesh
from vistel.figure.usd_fault import reason


@dataclass
class _Part:
    """A mesh prim: points (N, 3) in the stage's frame, triangles (F, 3), uv (T, 2), uv_triangles (F, 3), material (F,)."""

    name: str
    points: F64
    triangles: I32
    uv: F64
    uv_triangles: I32
    material: I32
    joints: list[str] = field(default_factory=list[str])
    weight: NDArray[np.float32] | None = None


def read_usd(path: Path, named: Callable[[Any], str] | None = None) -> SourceMesh:
    """The mesh of a USD file. named: what the group of a mesh prim is called, by default as the prim. Raises MakingError,
    OSError."""
    if not path.is_file():
        raise FileNotFoundError(2, "No such file", str(path))
    try:
        return _Stage(opened(path), path, named).source()
    except Tf.ErrorException as fault:
        raise MakingError(f"{path}: not a whole USD file ({reason(fault)})") from fault
    except (TypeError, ValueError, KeyError, AttributeError, IndexError, RuntimeError) as fault:
        if isinstance(fault, MakingError):
            raise
        raise MakingError(f"{path}: not as USD has it ({fault}); export the file again") from fault


def _name(prim: Any) -> str:
    return prim.GetName()


class _Stage:
    def __init__(self, stage: Any, path: Path, named: Callable[[Any], str] | None) -> None:
        self.stage, self.path, self.notes = stage, path, list[str]()
        self.named: Callable[[Any], str] = named or _name
        self.cache, self.skel = UsdGeom.XformCache(), UsdSkel.Cache()
        self.materials = Materials(stage, path, self.notes, patches=named is None)
        self.rigs: dict[str, Any] = {}
        self.morphs = 0

    def source(self) -> SourceMesh:
        everything = Usd.PrimRange(self.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
        parts: list[_Part] = []
        for prim in everything:
            if prim.IsA(UsdSkel.Root):
                self.skel.Populate(UsdSkel.Root(prim), Usd.TraverseInstanceProxies())
        for prim in Usd.PrimRange(self.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
            if prim.IsA(UsdGeom.Mesh) and self._shown(UsdGeom.Mesh(prim)):
                part = self._mesh(UsdGeom.Mesh(prim))
                if part is not None:
                    parts.append(part)
        if not parts:
            raise MakingError(f"{self.path}: no meshes; expected a USD file with the surface of a person")
        if self.morphs:
            self.notes.append(f"{self.morphs} blend shapes left out: figures move by their joints")
        if len(self.rigs) > 1:
            self.notes.append(f"{len(self.rigs)} skeletons: taken as one, joints of one name as one joint")
        counts = [len(p.triangles) for p in parts]
        starts, uv_starts = (
            np.cumsum([0, *(len(a) for a in arrays)]) for arrays in ([p.points for p in parts], [p.uv for p in parts])
        )
        points = np.vstack([p.points for p in parts])
        if not np.isfinite(points).all():
            raise MakingError(f"{self.path}: points that are not finite; repair the mesh")
        uv = [np.where(p.uv_triangles >= 0, p.uv_triangles + s, -1) for p, s in zip(parts, uv_starts, strict=False)]
        unit = UsdGeom.GetStageMetersPerUnit(self.stage) if UsdGeom.StageHasAuthoredMetersPerUnit(self.stage) else None
        up = str(UsdGeom.GetStageUpAxis(self.stage)).upper() if self.stage.HasAuthoredMetadata("upAxis") else None
        return SourceMesh(
            self.path.stem,
            points,
            np.vstack([p.triangles + s for p, s in zip(parts, starts, strict=False)]).astype(np.int32),
            np.nan_to_num(np.vstack([p.uv for p in parts])),
            np.vstack(uv).astype(np.int32),
            np.repeat(np.arange(len(parts)), counts).astype(np.int32),
            tuple(p.name for p in parts),
            np.concatenate([p.material for p in parts]).astype(np.int32),
            self.materials.all(),
            self._rig(parts),
            unit,
            up,
            tuple(self.notes),
        )

    def _shown(self, mesh: Any) -> bool:
        purpose = mesh.ComputePurpose()
        return mesh.ComputeVisibility() != UsdGeom.Tokens.invisible and purpose in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)

    def _mesh(self, mesh: Any) -> _Part | None:
        prim, when = mesh.GetPrim(), _earliest(self.stage)
        points = np.array(mesh.GetPointsAttr().Get(when) or [], np.float64).reshape(-1, 3)
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get(when) or [], np.int64)
        index = np.array(mesh.GetFaceVertexIndicesAttr().Get(when) or [], np.int64)
        if not len(points) or not len(index):
            return None
        if counts.sum() != len(index) or counts.min() < 0 or index.min() < 0 or index.max() >= len(points):
            raise MakingError(f"{self.path}: {prim.GetPath()}: faces of vertices that are not there; export the file again")
        corners, face = _fans(counts)
        flipped = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
        uv, uv_index = self._uv(prim, index, counts)
        matrix = np.array(self.cache.GetLocalToWorldTransform(prim), np.float64)
        joints: list[str] = []
        weight = None
        query = self.skel.GetSkinningQuery(prim)
        if query and query.HasJointInfluences():
            points, joints, weight, matrix = self._skinned(query, prim, points, matrix, when)
        if query and query.HasBlendShapes():
            self.morphs += len(query.GetBlendShapeOrder() or [])
        points = points @ matrix[:3, :3] + matrix[3, :3]
        if flipped != (np.linalg.det(matrix[:3, :3]) < 0.0):
            corners = corners[:, ::-1]
        at = uv_index[corners] if uv_index is not None else np.full(corners.shape, -1)
        material = self.materials.of_faces(mesh, len(counts))[face]
        return _Part(self.named(prim), points, index[corners].astype(np.int32), uv, at.astype(np.int32), material, joints, weight)

    def _uv(self, prim: Any, index: NDArray[np.int64], counts: NDArray[np.int64]) -> tuple[F64, NDArray[np.int64] | None]:
        """Texture coordinates, and which of them each corner of a face has; None where there are none."""
        found = [p for p in UsdGeom.PrimvarsAPI(prim).FindPrimvarsWithInheritance() if _is_uv(p) and p.HasValue()]
        found.sort(key=lambda p: (p.GetPrimvarName() != "st", "st" not in p.GetPrimvarName().lower()))
        for primvar in found:
            values = np.array(primvar.Get(_earliest(self.stage)), np.float64).reshape(-1, 2)
            indices = primvar.GetIndices()
            place = np.array(indices, np.int64) if indices else np.arange(len(values))
            kind = primvar.GetInterpolation()
            if kind == UsdGeom.Tokens.faceVarying and len(place) == len(index):
                out = place
            elif kind in (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying) and len(place) > index.max():
                out = place[index]
            elif kind == UsdGeom.Tokens.uniform and len(place) == len(counts):
                out = np.repeat(place, counts)
            else:
                continue
            if out.min() >= 0 and out.max() < len(values):
                return values, out
        return np.zeros((0, 2)), None

    def _skinned(
        self, query: Any, prim: Any, points: F64, matrix: F64, when: Any
    ) -> tuple[F64, list[str], NDArray[np.float32], F64]:
        """Points as the skeleton stands, its joints' names, shares of them, and the matrix to the stage's frame."""
        skeleton = self._skeleton_of(prim)
        if skeleton is None:
            return points, [], np.zeros((len(points), 0), np.float32), matrix
        names = [str(j) for j in skeleton.GetJointOrder()]
        self.rigs.setdefault(str(skeleton.GetPrim().GetPath()), skeleton)
        order = [str(j) for j in query.GetJointOrder() or names]
        place = {name: k for k, name in enumerate(names)}
        influences = query.ComputeVaryingJointInfluences(len(points), when)
        joint, share = (np.array(a).reshape(len(points), -1) for a in influences)
        if not share.size or joint.min() < 0 or joint.max() >= len(order):
            raise MakingError(f"{self.path}: {prim.GetPath()}: weights that fit no joints; export the file again")
        of = np.array([place.get(name, -1) for name in order])
        weight = np.zeros((len(points), len(names) + 1), np.float32)
        for k in range(joint.shape[1]):
            np.add.at(weight, (np.arange(len(points)), of[joint[:, k]]), share[:, k])
        moved = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))
        transforms = skeleton.ComputeSkinningTransforms(when)
        if query.IsRigidlyDeformed():
            own = query.ComputeSkinnedTransform(transforms, when)
            return points, names, weight[:, :-1], np.array(own) @ np.array(self._world_of(skeleton))
        if not query.ComputeSkinnedPoints(transforms, moved, when):
            raise MakingError(f"{self.path}: {prim.GetPath()}: cannot be bent by its skeleton; export the file again")
        world = self._world_of(skeleton)
        return np.array(moved, np.float64), names, weight[:, :-1], np.array(Gf.Matrix4d(world))

    def _skeleton_of(self, prim: Any) -> Any:
        bound = UsdSkel.BindingAPI(prim).GetInheritedSkeleton()
        query = self.skel.GetSkelQuery(bound) if bound else None
        return query if query else None

    def _world_of(self, skeleton: Any) -> Any:
        return self.cache.GetLocalToWorldTransform(skeleton.GetPrim())

    def _rig(self, parts: list[_Part]) -> Rig | None:
        names: list[str] = []
        parents: list[int] = []
        at: list[F64] = []
        for skeleton in self.rigs.values():
            transforms = skeleton.ComputeJointSkelTransforms(_earliest(self.stage))
            world = np.array(self._world_of(skeleton), np.float64)
            place = {name: k for k, name in enumerate(names)}
            order = [str(j) for j in skeleton.GetJointOrder()]
            up: list[int] = list(skeleton.GetTopology().GetParentIndices())
            for k, name in enumerate(order):
                if name in place:
                    continue
                parents.append(names.index(order[up[k]]) if up[k] >= 0 else -1)
                names.append(name)
                at.append(np.array(transforms[k].ExtractTranslation()) @ world[:3, :3] + world[3, :3])
        if not names:
            return None
        place = {name: k for k, name in enumerate(names)}
        weight = np.zeros((sum(len(p.points) for p in parts), len(names)), np.float32)
        start = 0
        for part in parts:
            if part.weight is not None and part.joints:
                weight[start : start + len(part.points), [place[n] for n in part.joints]] = part.weight
            start += len(part.points)
        bare = tuple(n.rpartition("/")[2] for n in names)
        return Rig(bare, np.array(parents, np.int32), np.array(at), weight)


def _earliest(stage: Any) -> Any:
    return Usd.TimeCode(stage.GetStartTimeCode()) if stage.HasAuthoredTimeCodeRange() else Usd.TimeCode.Default()


def _is_uv(primvar: Any) -> bool:
    kind = str(primvar.GetTypeName())
    return kind.startswith("texCoord2") or (kind.startswith(("float2", "double2", "half2")) and "[]" in kind)


def _fans(counts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(F, 3) corners of the triangles into which polygons of these sizes are cut, and the polygon of each."""
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    face = np.repeat(np.arange(len(counts)), np.maximum(counts - 2, 0))
    first = np.concatenate([[0], np.cumsum(np.maximum(counts - 2, 0))[:-1]])
    k = np.arange(len(face)) - first[face]
    return np.column_stack([starts[face], starts[face] + k + 1, starts[face] + k + 2]), face

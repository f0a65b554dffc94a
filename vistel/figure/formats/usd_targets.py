"""Targets of expressions in USD: blend shapes of UsdSkel, under the mesh that they move."""

from typing import Any

import numpy as np
from pxr import Tf, UsdSkel, Vt

from vistel.figure.avatar.avatar import Mesh, Target


def write_targets(stage: Any, at: str, binding: Any, mesh: Mesh) -> None:
    """Blend shapes of the mesh at the path `at`; binding: its UsdSkel.BindingAPI."""
    if not mesh.targets:
        return
    paths: list[str] = []
    for k, target in enumerate(mesh.targets):
        # Two names may differ in what a path of USD cannot hold.
        paths.append(f"{at}/{Tf.MakeValidIdentifier(target.name)}_{k}")
        shape = UsdSkel.BlendShape.Define(stage, paths[-1])
        shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(target.offset, np.float32)))
        shape.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(target.vertex, np.int32)))
    binding.CreateBlendShapesAttr([t.name for t in mesh.targets])
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)


def read_targets(stage: Any, prim: Any) -> tuple[Target, ...]:
    """What `write_targets` wrote; in-between shapes of others are passed over. Raises ValueError."""
    binding = UsdSkel.BindingAPI(prim)
    names: list[str] = list(binding.GetBlendShapesAttr().Get() or ())
    paths = binding.GetBlendShapeTargetsRel().GetTargets()
    out: list[Target] = []
    for name, path in zip(names, paths, strict=True):
        shape = UsdSkel.BlendShape(stage.GetPrimAtPath(path))
        offset = np.array(shape.GetOffsetsAttr().Get(), np.float32).reshape(-1, 3)
        index = shape.GetPointIndicesAttr().Get()
        vertex = np.arange(len(offset), dtype=np.int32) if index is None else np.array(index, np.int32)
        out.append(Target(str(name), vertex, offset))
    return tuple(out)

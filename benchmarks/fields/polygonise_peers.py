"""Run by the peers' own interpreter: a whole pipeline from field to mesh, in processor time.

python polygonise_peers.py FOLDER SCENE SIDE flying_edges|scikit_image|blender - FOLDER holds the peers' `scenes.py`.
Prints one line of JSON: milliseconds (median), name and version, triangles.
"""

# pyright: basic, reportMissingImports=false

import json
import os
import sys
import time
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "VTK_SMP_MAX_THREADS"):
    os.environ[_name] = "1"

import numpy as np

REPEATS = 7


def flying_edges(scenes: Any, name: str, n: int) -> Any:
    """Boxed NumPy field, then VTK's Flying Edges on one thread, without normals."""
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk

    vtk.vtkSMPTools.SetBackend("Sequential")
    step = (scenes.HI - scenes.LO) / (n - 1)

    def call() -> tuple[str, int]:
        field = scenes.field_boxed(np, name, n)
        image = vtk.vtkImageData()
        image.SetDimensions(n, n, n)
        image.SetSpacing(step, step, step)
        # Without a copy: the axes are turned round, which changes nothing about the time.
        image.GetPointData().SetScalars(numpy_to_vtk(field.ravel(), deep=False))
        edges = vtk.vtkFlyingEdges3D()
        edges.SetInputData(image)
        edges.SetValue(0, scenes.T)
        edges.ComputeNormalsOff()
        edges.ComputeGradientsOff()
        edges.ComputeScalarsOff()
        edges.Update()
        return f"boxed NumPy and VTK {vtk.vtkVersion().GetVTKVersion()} Flying Edges", edges.GetOutput().GetNumberOfPolys()

    return call


def scikit_image(scenes: Any, name: str, n: int) -> Any:
    """Boxed NumPy field, then marching_cubes (which also makes normals)."""
    import skimage
    from skimage.measure import marching_cubes

    def call() -> tuple[str, int]:
        faces = marching_cubes(scenes.field_boxed(np, name, n), scenes.T)[1]
        return f"boxed NumPy and scikit-image {skimage.__version__}", len(faces)

    return call


def blender(scenes: Any, name: str, n: int) -> Any:
    """Metaballs: field and surface tracking; the threshold gives a ball alone the same radius."""
    import bpy
    from mathutils import Vector

    bpy.ops.wm.read_factory_settings(use_empty=True)
    data = bpy.data.metaballs.new("m")
    data.resolution = data.render_resolution = (scenes.HI - scenes.LO) / n
    data.threshold = scenes.T**1.5
    body = bpy.data.objects.new("m", data)
    bpy.context.scene.collection.objects.link(body)
    balls, capsules = scenes.scene(name)
    for centre, radius, _ in balls:
        element = data.elements.new(type="BALL")
        element.co, element.radius, element.stiffness = centre, radius, 1.0
    for a, b, radius, _ in capsules:
        element = data.elements.new(type="CAPSULE")
        along = Vector([b[k] - a[k] for k in range(3)])
        element.co, element.radius, element.stiffness = [(a[k] + b[k]) / 2 for k in range(3)], radius, 1.0
        element.size_x, element.rotation = along.length / 2, Vector((1, 0, 0)).rotation_difference(along)

    def call() -> tuple[str, int]:
        data.elements[0].co.x += 1e-7
        data.update_tag()
        bpy.context.view_layer.update()
        mesh = body.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
        return f"Blender {bpy.app.version_string} metaballs", sum(max(0, len(p.vertices) - 2) for p in mesh.polygons)

    return call


def main() -> None:
    folder, name, side, which = sys.argv[1:5]
    sys.path.insert(0, folder)
    import scenes

    out = os.dup(1)
    os.dup2(2, 1)  # some of them chatter
    call = {"flying_edges": flying_edges, "scikit_image": scikit_image, "blender": blender}[which](scenes, name, int(side))
    call()
    times = []
    for _ in range(REPEATS):
        begin = time.process_time(), time.perf_counter()
        label, triangles = call()
        # Threads that only wait for work count as processor time: never more than went by on the clock.
        times.append(1e3 * min(time.process_time() - begin[0], time.perf_counter() - begin[1]))
    os.write(out, (json.dumps({"ms": sorted(times)[REPEATS // 2], "name": label, "triangles": triangles}) + "\n").encode())


if __name__ == "__main__":
    main()

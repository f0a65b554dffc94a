"""Scenes: shapes, polygon objects, lights and a camera, made in Python or read from a TOML file.

    from vistel.implicit.scene import Camera, Light, Material, Mesh, Scene, load

    scene = load("examples/scenes/blobs.toml")           # or, without a file:
    scene = Scene(shape=Material(colour=(0.8, 0.5, 0.4)).on(vi.Sphere((0, 0, 0), 0.4)),
                  camera=Camera((5, 5, 5)), lights=(Light(position=(10, 20, 5)),))

    scene.shape            vistel.implicit Shape or None; materials are its attributes colour, finish and bump
    scene.program          its FieldProgram (compiled once); program.attributes(points) gives colour (n, 3), finish (n, 5)
    scene.threshold        the level T of the surface
    scene.meshes           polygon objects: vertices (n, 3), triangles (m, 3), material
    scene.camera           camera.rays(size, pixels) -> origins, directions; camera.project(points, size) -> pixels, depths
    scene.lights, scene.background, scene.size (width, height)

    write_png(path, light)  writes linear light (h, w, 3); check_writable(path) beforehand

Colours are linear light. Every dataclass is frozen; `load` raises SceneError, one line per fault: file: key: what was expected.
See docs/reference/scene-file.md.
"""

from vistel.implicit.scene.file import load, parse
from vistel.implicit.scene.mesh_file import read_polygons
from vistel.implicit.scene.model import Camera, Light, Mesh, Scene, SceneError, ground, mesh_of
from vistel.implicit.scene.picture import check_writable, encoded, write_png
from vistel.implicit.scene.surface import Checker, Image, ImageHeight, Material, Ripples, Waves

__all__ = [
    "Camera",
    "Checker",
    "Image",
    "ImageHeight",
    "Light",
    "Material",
    "Mesh",
    "Ripples",
    "Scene",
    "SceneError",
    "Waves",
    "check_writable",
    "encoded",
    "ground",
    "load",
    "mesh_of",
    "parse",
    "read_polygons",
    "write_png",
]

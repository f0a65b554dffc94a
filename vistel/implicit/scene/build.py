"""From the tables of a scene file to shapes, meshes and materials of the library."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import vistel.implicit.scene.entries as e
from vistel.implicit.checks import ShapeError
from vistel.implicit.graph.combine import Complement, Diff, Sum, difference, intersection, selective, subtract, total, union
from vistel.implicit.graph.primitive import Primitive
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.offset import ConeSphere, RoundedPolygon, Sphere, Sphylinder
from vistel.implicit.primitives.pointblob import Pointblob, PointSetblob
from vistel.implicit.primitives.polyblob import Polyblob
from vistel.implicit.primitives.polyhedron import Polyhedron, box, prism, sphere_mesh, torus_mesh
from vistel.implicit.primitives.superquadric import Superellipsoid, Supertoroid
from vistel.implicit.primitives.volume import Volume
from vistel.implicit.scene.mesh_file import read_polygons
from vistel.implicit.scene.model import Mesh, SceneError, ground
from vistel.implicit.scene.surface import Checker, Image, ImageHeight, Material, Ripples, Texture, Waves


class Builder:
    """Makes what the tables describe, each named shape once, so that what is shared stays shared."""

    def __init__(self, scene: e.SceneEntry, folder: Path) -> None:
        self.scene, self.folder = scene, folder
        self.done: dict[str, Shape] = {}
        self.open: list[str] = []
        self.materials = {name: self._material(f"materials.{name}", m) for name, m in scene.materials.items()}

    def shape(self, name: str, asked_by: str) -> Shape:
        """The shape of a name."""
        if name in self.done:
            return self.done[name]
        if name not in self.scene.shapes:
            raise SceneError(f"{asked_by}: names the shape {name!r}, expected one of {_some(self.scene.shapes)}")
        if name in self.open:
            raise SceneError(f"shapes.{name}: is made of itself ({' of '.join([*self.open, name])})")
        self.open.append(name)
        self.done[name] = self._shape(self.scene.shapes[name], f"shapes.{name}")
        self.open.pop()
        return self.done[name]

    def material(self, name: str, asked_by: str) -> Material:
        """The material of a name."""
        if name not in self.materials:
            raise SceneError(f"{asked_by}.material: is {name!r}, expected one of {_some(self.materials)}")
        return self.materials[name]

    def mesh(self, entry: e.MeshEntry, key: str) -> Mesh:
        """A polygon object."""
        material = self.material(entry.material, key) if entry.material else Material()
        if entry.ground is not None:
            plain = ground(entry.ground, entry.extent, material)
            vertices, triangles = plain.vertices, plain.triangles
        else:
            assert entry.solid is not None
            vertices, triangles = self._polygons(entry.solid, f"{key}.solid")
        return Mesh(_placed_points(entry, vertices), triangles, material, entry.smooth)

    def _shape(self, entry: Any, key: str) -> Shape:
        try:
            made = self._made(entry, key)
        except ShapeError as error:
            raise SceneError(f"{key}: {error}") from error
        if entry.material:
            made = self.material(entry.material, key).on(made)
        if entry.scale != 1.0:
            made = made.scaled(entry.scale)
        if entry.rotate is not None or any(entry.translate):
            made = made.moved(entry.translate, entry.quaternion)
        return made

    def _made(self, entry: Any, key: str) -> Shape:
        if isinstance(entry, e.PrimitiveEntry):
            return self._primitive(entry, key)
        parts = [
            self.shape(p, f"{key}.of[{i}]") if isinstance(p, str) else self._shape(p, f"{key}.of[{i}]")
            for i, p in enumerate(entry.of)
        ]
        match entry:
            case e.SumEntry():
                return Sum(tuple(parts), tuple(entry.weights)) if entry.weights is not None else total(*parts)
            case e.UnionEntry():
                return (union if entry.kind == "union" else intersection)(*parts, power=entry.power)
            case e.DifferenceEntry() | e.SubtractEntry():
                if len(parts) < 2:
                    raise SceneError(f"{key}.of: has one shape, expected two or more")
                result = parts[0]
                for other in parts[1:]:
                    if isinstance(entry, e.SubtractEntry):
                        result = subtract(result, other)
                    else:
                        result = difference(result, other, threshold=self.scene.threshold, power=entry.power)
                return result
            case e.ComplementEntry():
                return Complement(_only(parts, key), self.scene.threshold)
            case e.DiffEntry():
                return Diff(tuple(parts), entry.power, entry.eps)
            case e.SelectiveEntry():
                return selective(parts, entry.blends)
            case _:
                raise SceneError(f"{key}: nothing builds a {type(entry).__name__}")

    def _primitive(self, p: e.PrimitiveEntry, key: str) -> Shape:
        options: dict[str, Any] = {"weight": p.weight, "blend": p.blend}
        surface = p.sizes == "surface"
        if surface:
            options["threshold"] = self.scene.threshold

        def make(kind: Any, *args: Any, **more: Any) -> Shape:
            maker: Callable[..., Shape] = kind.of_surface if surface else kind
            return maker(*args, **options, **more)

        match p:
            case e.SphereEntry():
                return make(Sphere, p.centre, p.radius)
            case e.SphylinderEntry():
                return make(Sphylinder, p.start, p.end, p.radius)
            case e.ConeSphereEntry():
                return make(ConeSphere, p.start, p.end, *p.radii, printed=p.printed)
            case e.RoundedPolygonEntry():
                return make(RoundedPolygon, np.array(p.vertices), p.radius)
            case e.SuperellipsoidEntry():
                return make(Superellipsoid, p.centre, p.half_axes, p.e1, p.e2)
            case e.SupertoroidEntry():
                return make(Supertoroid, p.centre, p.half_axes, p.alpha, p.e1, p.e2)
            case e.PointblobEntry():
                return make(Pointblob, self._volume(p.volume, key), p.centre, relaxed=p.relaxed)
            case e.PointSetblobEntry():
                return PointSetblob(
                    self._volume(p.volume, key),
                    np.array(p.centres),
                    tuple(p.blends),
                    p.smoothing,
                    self.scene.threshold,
                    p.printed,
                    relaxed=p.relaxed,
                    weight=p.weight,
                    blend=p.blend,
                )
            case e.PolyblobEntry():
                hull, core = self._solid(p.hull, f"{key}.hull"), self._solid(p.core, f"{key}.core")
                return Polyblob(hull, core, weight=p.weight, blend=p.blend)
            case _:
                raise SceneError(f"{key}: nothing builds a {type(p).__name__}")

    def _volume(self, volume: e.PolyhedronEntry | str, key: str) -> Volume:
        if isinstance(volume, e.PolyhedronEntry):
            return self._solid(volume, f"{key}.volume")
        named = self.shape(volume, f"{key}.volume")
        if not isinstance(named, Primitive):
            raise SceneError(f"{key}.volume: {volume!r} is not a bare primitive, expected one without placement or material")
        return named

    def _solid(self, entry: e.PolyhedronEntry, key: str) -> Polyhedron:
        try:
            match entry:
                case e.PolyhedronEntry(box=half) if half is not None:
                    made = box(half)
                case e.PolyhedronEntry(sphere=radius) if radius is not None:
                    made = sphere_mesh(radius, *entry.divisions)
                case e.PolyhedronEntry(torus=radii) if radii is not None:
                    made = torus_mesh(*radii, *entry.divisions)
                case e.PolyhedronEntry(prism=outline) if outline is not None:
                    made = prism(np.array(outline), *entry.depth)
                case _:
                    made = Polyhedron(*self._read(entry))
            return Polyhedron(_placed_points(entry, made.vertices), made.faces)
        except (ShapeError, SceneError) as error:
            raise SceneError(f"{key}: {error}") from error

    def _polygons(self, entry: e.PolyhedronEntry, key: str) -> tuple[Any, Any]:
        """Vertices and triangles; a file or a list of faces need not be closed here."""
        if entry.file is None and entry.vertices is None:
            solid = self._solid(entry, key)
            return solid.vertices, solid.triangles
        try:
            vertices, faces = self._read(entry)
        except SceneError as error:
            raise SceneError(f"{key}: {error}") from error
        fans = [(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)]
        return _placed_points(entry, vertices), np.array(fans)

    def _read(self, entry: e.PolyhedronEntry) -> tuple[Any, tuple[tuple[int, ...], ...]]:
        if entry.file is not None:
            return read_polygons(self.folder / entry.file)
        assert entry.vertices is not None and entry.faces is not None
        return np.array(entry.vertices), tuple(map(tuple, entry.faces))

    def _material(self, key: str, m: e.MaterialEntry) -> Material:
        finish = (m.ambient, m.diffuse, m.specular, m.shininess, m.reflection)
        texture, bump = self._texture(m.texture, f"{key}.texture"), self._texture(m.bump, f"{key}.bump")
        return Material(m.colour, *finish, texture, bump)

    def _texture(self, entry: Any, key: str) -> Texture | None:
        match entry:
            case e.CheckerEntry():
                return Checker(*entry.checker, entry.size)
            case e.ImageHeightEntry():
                return ImageHeight(self._picture(entry.image, key), entry.projection, entry.scale, entry.height)
            case e.ImageEntry():
                return Image(self._picture(entry.image, key), entry.projection, entry.scale)
            case e.WavesEntry():
                return Waves(entry.waves, entry.length, entry.direction)
            case e.RipplesEntry():
                return Ripples(entry.ripples, entry.length)
            case _:
                return None

    def _picture(self, path: Path, key: str) -> Path:
        file = self.folder / path
        if not file.is_file():
            raise SceneError(f"{key}.image: {file} is not a file, expected a picture")
        return file


def _placed_points(entry: e.Placing, points: Any) -> Any:
    x, y, z, w = entry.quaternion
    v = np.array((x, y, z))
    p = np.asarray(points, np.float64) * entry.scale
    p = p + 2 * np.cross(v, np.cross(v, p) + w * p)
    return p + np.array(entry.translate)


def _only(parts: list[Shape], key: str) -> Shape:
    if len(parts) != 1:
        raise SceneError(f"{key}.of: has {len(parts)} shapes, expected one")
    return parts[0]


def _some(names: Any) -> str:
    listed = sorted(names)
    return ", ".join(listed[:8]) + (f" and {len(listed) - 8} more" if len(listed) > 8 else "") if listed else "none defined"

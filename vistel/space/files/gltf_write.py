"""Rooms in GLB for everything that draws: a node for each thing where it is, polymeshes with pictures, primitives as triangles.

What only the world needs stays behind; USD keeps it.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.colour import linear
from vistel.figure.formats.gltf_binary import INDICES, Binary, smallest
from vistel.space.files.interior import Interior
from vistel.space.files.model import Polymesh
from vistel.space.files.surfaces import SurfacePiece, pieces_of
from vistel.space.things.things import Thing
from vistel.whole_file import whole_file

UNLIT = "KHR_materials_unlit"
"""The extension for what shines by itself."""
Pieces = Callable[[Thing, Mapping[str, Polymesh]], Sequence[SurfacePiece]]
"""All that is drawn of a thing, as `pieces_of` has it."""


def save_glb(interior: Interior, path: Path) -> None:
    """Writes a .glb, whole or not at all. Raises OSError, and ValueError for another ending."""
    if path.suffix.lower() != ".glb":
        raise ValueError(f"{path}: expected a name that ends in .glb")
    data = glb_bytes(interior)
    with whole_file(path) as stream:
        stream.write(data)


def glb_bytes(interior: Interior, pieces: Pieces = pieces_of) -> bytes:
    """What `save_glb` writes. pieces: what is drawn of each thing, a primitive of its mesh for each."""
    return _Writer(pieces).whole(interior)


class _Writer(Binary):
    def __init__(self, pieces: Pieces) -> None:
        super().__init__()
        self._pieces = pieces
        self.materials: list[dict[str, Any]] = []
        self.images: list[dict[str, Any]] = []
        self.meshes: list[dict[str, Any]] = []
        self._known: dict[tuple[Any, ...], int] = {}
        self._keep: list[NDArray[np.uint8]] = []

    def whole(self, interior: Interior) -> bytes:
        nodes = [self._node(thing, interior) for thing in interior.room.things]
        for n, seat in enumerate(interior.room.seats):
            half = 0.5 * seat.heading
            turn = [0.0, float(np.sin(half)), 0.0, float(np.cos(half))]
            nodes.append({"name": f"seat_{n}", "translation": seat.position.tolist(), "rotation": turn})
        tree: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "VISTEL"},
            "scene": 0,
            "scenes": [{"name": "room", "nodes": list(range(len(nodes)))} if nodes else {"name": "room"}],
        }
        for name, rows in (("nodes", nodes), ("meshes", self.meshes), ("materials", self.materials), ("images", self.images)):
            if rows:
                tree[name] = rows
        if any("extensions" in m for m in self.materials):
            tree["extensionsUsed"] = [UNLIT]
        if self.images:
            tree["textures"] = [{"source": n, "sampler": 0} for n in range(len(self.images))]
            tree["samplers"] = [{"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}]
        return self.glb(tree)

    def _node(self, t: Thing, interior: Interior) -> dict[str, Any]:
        rotation = t.rotation / np.linalg.norm(t.rotation)
        node: dict[str, Any] = {"name": t.id, "translation": t.position.tolist(), "rotation": rotation.tolist()}
        pieces = [self._primitive(p) for p in self._pieces(t, interior.models)]
        if pieces:
            node["mesh"] = len(self.meshes)
            self.meshes.append({"name": t.name or t.id, "primitives": pieces})
        return node

    def _primitive(self, p: SurfacePiece) -> dict[str, Any]:
        s = p.surface
        length = np.linalg.norm(s.normals, axis=1, keepdims=True)
        normals = np.where(length > 1e-6, s.normals / np.maximum(length, 1e-12), (0.0, 1.0, 0.0)).astype(np.float32)
        attributes = {"POSITION": self.accessor(s.vertices, bounds=True), "NORMAL": self.accessor(normals)}
        if p.uv is not None:
            attributes["TEXCOORD_0"] = self.accessor(np.column_stack([p.uv[:, 0], np.float32(1.0) - p.uv[:, 1]]))
        index = self.accessor(smallest(s.triangles.reshape(-1, 1)), target=INDICES)
        return {"attributes": attributes, "indices": index, "material": self._material(p), "mode": 4}

    def _material(self, p: SurfacePiece) -> int:
        key = (id(p.picture), p.mesh, p.finish) if p.picture is not None else (*p.colour, p.mesh, p.finish)
        if key not in self._known:
            look: dict[str, Any] = {"metallicFactor": p.finish.metallic, "roughnessFactor": p.finish.roughness}
            if p.picture is not None:
                self._keep.append(p.picture)  # its id stays its own
                self.images.append(self.image(p.picture))
                look["baseColorTexture"] = {"index": len(self.images) - 1}
            else:
                look["baseColorFactor"] = [*linear(np.array(p.colour) / 255.0).tolist(), 1.0]
            self._known[key] = len(self.materials)
            shines: dict[str, Any] = {"extensions": {UNLIT: {}}} if p.glows else {}
            self.materials.append({"pbrMetallicRoughness": look, "doubleSided": p.mesh} | shines)
        return self._known[key]

"""The room that does not move in GLB, for programs that draw with triangles and pictures: shell, table top and furniture.

Light is baked into the pictures: their materials are unlit (KHR_materials_unlit). Nodes on which shadows of people and things fall
are called "shadowed"; furniture has colours at its vertices and takes light.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vistel.arrays import F32, I32
from vistel.figure.formats.gltf_binary import INDICES, Binary, smallest
from vistel.render.light.shadow import KEY_DIRECTION
from vistel.render.room.room import FURNITURE, KEY_SHADOWED, Furniture, ShellPanel, build_room, finished
from vistel.space.room import Room

__all__ = ["FURNITURE", "room_glb"]

_UNLIT = "KHR_materials_unlit"
_ROUGH = 0.7
"""Of furniture."""


def room_glb(room: Room) -> bytes:
    """The file; its nodes are in the room's frame [m]."""
    return _Writer().whole(*build_room(room))


class _Writer(Binary):
    def whole(self, panels: list[ShellPanel], furniture: Furniture | None) -> bytes:
        images: list[dict[str, Any]] = []
        materials: list[dict[str, Any]] = []
        meshes: list[dict[str, Any]] = []
        nodes: list[dict[str, Any]] = []
        for panel in panels:
            shadowed = panel.key == KEY_SHADOWED
            seen = finished(panel.texture, float(KEY_DIRECTION[1])) if shadowed else panel.texture
            base = {"baseColorTexture": {"index": len(images)}, "metallicFactor": 0.0, "roughnessFactor": 1.0}
            images.append(self.image(np.ascontiguousarray(seen[..., :3])))
            uv = np.column_stack([panel.uv[:, 0], np.float32(1.0) - panel.uv[:, 1]])
            nodes.append({"name": "shadowed" if shadowed else "shell", "mesh": len(meshes)})
            more = {"TEXCOORD_0": self.accessor(uv)}
            meshes.append(self._mesh(panel.positions, panel.normals, panel.triangles, len(materials), more))
            materials.append({"pbrMetallicRoughness": base, "extensions": {_UNLIT: {}}})
        if furniture is not None:
            s, tint = furniture.surface, furniture.tint
            colour = {"COLOR_0": self.accessor(np.ascontiguousarray(tint[:, :3] * (0.4 + 0.6 * tint[:, 3:])))}
            nodes.append({"name": "furniture", "mesh": len(meshes)})
            meshes.append(self._mesh(s.vertices, s.normals, s.triangles, len(materials), colour))
            materials.append({"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": _ROUGH}})
        tree: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "VISTEL"},
            "scene": 0,
            "scenes": [{"name": "room"} | ({"nodes": list(range(len(nodes)))} if nodes else {})],
        }
        if panels:
            tree |= {"extensionsUsed": [_UNLIT], "textures": [{"source": n, "sampler": 0} for n in range(len(images))]}
            tree["samplers"] = [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}]
        rows = {"nodes": nodes, "meshes": meshes, "materials": materials, "images": images}
        return self.glb(tree | {name: row for name, row in rows.items() if row})

    def _mesh(self, positions: F32, normals: F32, triangles: I32, material: int, more: dict[str, int]) -> dict[str, Any]:
        attributes = {"POSITION": self.accessor(positions, bounds=True), "NORMAL": self.accessor(normals), **more}
        index = self.accessor(smallest(triangles.reshape(-1, 1)), target=INDICES)
        return {"primitives": [{"attributes": attributes, "indices": index, "material": material, "mode": 4}]}

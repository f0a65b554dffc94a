"""Avatars in glTF 2.0 (.glb) and VRM 1.0 (.vrm): a skinned character for other programs.

Joints are nodes under the house's names, without rotation at rest, as VRM 1.0 wants them; skin and eyeballs are meshes of one skin.
Data that only VISTEL has (primitives, twist bones, bone ends, which drawn vertices are one) is in the extension VISTEL_avatar,
which other programs ignore; with it nothing of the shape is lost, and of pictures what JPEG leaves out. Coarser levels of detail
are not kept: reading makes them anew."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar, Mesh, Target
from vistel.figure.formats.gltf_animation import Movement, animation
from vistel.figure.formats.gltf_binary import Binary, smallest
from vistel.figure.formats.gltf_materials import extensions_used, primitives, write_materials
from vistel.figure.formats.vrm import EYES, vrm_extension
from vistel.figure.rigid.weights import influences, joints_only
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS
from vistel.geometry.normals import vertex_normals
from vistel.whole_file import whole_file

GLTF_ENDINGS = (".glb", ".vrm")
EXTENSION = "VISTEL_avatar"
FORMAT = 1


def save_gltf(avatar: Avatar, path: Path, *, author: str = "") -> None:
    """Writes .glb, or .vrm with the humanoid map of VRM 1.0; whole or not at all. author: for VRM's meta (default: the
    avatar's name). Raises OSError, and ValueError for another ending."""
    ending = path.suffix.lower()
    if ending not in GLTF_ENDINGS:
        raise ValueError(f"{path}: expected a name that ends in {', '.join(GLTF_ENDINGS)}")
    data = gltf_bytes(avatar, author=author, vrm=ending == ".vrm")
    with whole_file(path) as stream:
        stream.write(data)


def gltf_bytes(avatar: Avatar, *, author: str = "", vrm: bool = False, movement: Movement | None = None) -> bytes:
    """What `save_gltf` writes. movement: how the figure moves."""
    return _Writer().whole(avatar, author or avatar.name or "unknown", vrm, movement)


class _Writer(Binary):
    def whole(self, avatar: Avatar, author: str, vrm: bool, movement: Movement | None) -> bytes:
        bind = np.tile(np.eye(4), (len(JOINTS), 1, 1))
        bind[:, 3, :3] = -avatar.skeleton.rest  # column-major: the translation is the last row
        nodes = _joint_nodes(avatar)
        names = ("skin", *EYES)[: 1 + len(avatar.eyeballs)]
        meshes: list[dict[str, Any]] = []
        orders: list[dict[str, int]] = []
        for name, mesh in zip(names, (avatar.mesh, *avatar.eyeballs), strict=True):
            joint = None if name == "skin" else JOINT_INDEX[name]
            nodes.append({"name": name, "mesh": len(meshes), "skin": 0})
            told = {"extras": {"targetNames": [t.name for t in mesh.targets]}} if mesh.targets else {}
            parts, order = primitives(self, avatar, mesh, self._primitive(avatar, mesh, joint))
            meshes.append({"name": name, "primitives": parts} | told)
            orders.append({} if order is None else {"order": order})
        roots = [0, *range(len(JOINTS), len(nodes))]
        tree: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "VISTEL"},
            "scene": 0,
            "scenes": [{"name": avatar.name, "nodes": roots}],
            "nodes": nodes,
            "meshes": meshes,
            "skins": [
                {
                    "name": avatar.name,
                    "skeleton": 0,
                    "joints": list(range(len(JOINTS))),
                    "inverseBindMatrices": self.accessor(bind.reshape(-1, 16).astype(np.float32)),
                }
            ],
            "extensionsUsed": [EXTENSION, *extensions_used(avatar.patches)],
        }
        materials, patches = write_materials(self, avatar)
        tree |= materials
        exact = [self._exact(m) | order for m, order in zip((avatar.mesh, *avatar.eyeballs), orders, strict=True)]
        tree["extensions"] = {EXTENSION: _kept(avatar) | {"meshes": exact} | ({"patches": patches} if patches else {})}
        if movement is not None:
            targets = [t.name for t in avatar.mesh.targets]
            tree["animations"] = [animation(self, movement, avatar.name, len(JOINTS), targets)]
        if vrm:
            tree["extensionsUsed"].append("VRMC_vrm")
            tree["extensions"]["VRMC_vrm"] = vrm_extension(avatar, author)
        return self.glb(tree)

    def _primitive(self, avatar: Avatar, mesh: Mesh, joint: int | None) -> dict[str, Any]:
        rows = mesh.corner_vertex
        bone, weight = mesh.bone, mesh.weight
        if joint is not None:
            joints = np.tile(np.array((joint, 0, 0, 0), np.uint8), (len(rows), 1))
            shares = np.tile(np.array((65535, 0, 0, 0), np.uint16), (len(rows), 1))
        else:
            if bone is None or weight is None:
                bone, weight = influences(avatar.skeleton, mesh.vertices, mesh.triangles, avatar.body.joint[mesh.limb])
            only, share = joints_only(bone, weight)
            joints, shares = only[rows].astype(np.uint8), _whole_shares(share[rows].astype(np.float64))
            joints[shares == 0] = 0
        position, uv = mesh.vertices[rows], mesh.uv.astype(np.float32)
        attributes = {
            "POSITION": self.accessor(position, bounds=True),
            "NORMAL": self.accessor(_normals(mesh)[rows]),
            "TEXCOORD_0": self.accessor(np.column_stack([uv[:, 0], np.float32(1.0) - uv[:, 1]])),
            "JOINTS_0": self.accessor(joints),
            "WEIGHTS_0": self.accessor(shares, normalized=True),
        }
        moved = {"targets": [self._target(t, mesh) for t in mesh.targets]} if mesh.targets else {}
        return {"attributes": attributes, "mode": 4} | moved

    def _target(self, target: Target, mesh: Mesh) -> dict[str, int]:
        whole = np.zeros_like(mesh.vertices)
        whole[target.vertex] = target.offset
        return {"POSITION": self.sparse(whole[mesh.corner_vertex])}

    def _exact(self, mesh: Mesh) -> dict[str, int]:
        """Accessors of data that the drawn vertices lack."""
        out = {
            "vertex": self.accessor(smallest(mesh.corner_vertex)[:, None], target=None),
            "uv": self.accessor(mesh.uv.astype(np.float32), target=None),
            "limb": self.accessor(mesh.limb.astype(np.uint16)[:, None], target=None),
        }
        if mesh.bone is not None and mesh.weight is not None:
            out["bone"] = self.accessor(mesh.bone.astype(np.uint8), target=None)
            out["weight"] = self.accessor(mesh.weight.astype(np.float32), target=None)
        if mesh.hangs is not None:
            out["hangs"] = self.accessor(mesh.hangs.astype(np.float32)[:, None], target=None)
        return out


def _joint_nodes(avatar: Avatar) -> list[dict[str, Any]]:
    nodes: list[dict[str, Any]] = []
    for j, name in enumerate(JOINTS):
        node: dict[str, Any] = {"name": name, "translation": avatar.skeleton.offsets[j].tolist()}
        children = np.flatnonzero(j == PARENTS).tolist()
        nodes.append(node | ({"children": children} if children else {}))
    return nodes


def _kept(avatar: Avatar) -> dict[str, Any]:
    """Data for VISTEL alone, with exact numbers."""
    b = avatar.body
    wears = {"wrinkles": avatar.wrinkles} if avatar.wrinkles else {}
    return wears | {
        "format": FORMAT,
        "name": avatar.name,
        "registration": [asdict(r) for r in avatar.registration],
        "rest": avatar.skeleton.rest.tolist(),
        "tip": avatar.skeleton.tip.tolist(),
        "primitives": {
            "names": list(b.names),
            "joint": b.joint.tolist(),
            "a": b.a.tolist(),
            "b": b.b.tolist(),
            "radiusA": b.radius_a.tolist(),
            "radiusB": b.radius_b.tolist(),
        },
    }


def _normals(mesh: Mesh) -> NDArray[np.float32]:
    """(V, 3) of unit length, smooth; upwards where there is none."""
    out = vertex_normals(mesh.vertices.astype(np.float64), mesh.triangles)
    out[np.linalg.norm(out, axis=1) < 0.5] = (0.0, 1.0, 0.0)
    return out.astype(np.float32)


def _whole_shares(share: F64) -> NDArray[np.uint16]:
    """(N, 4) shares as 16-bit integers whose sum is exactly their largest, as glTF wants it."""
    whole: F64 = np.rint(65535.0 * share / share.sum(axis=1, keepdims=True))
    whole[np.arange(len(whole)), whole.argmax(axis=1)] += 65535.0 - whole.sum(axis=1)
    return whole.astype(np.uint16)

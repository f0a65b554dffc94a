"""Materials of an avatar in glTF: one for the texture and one for each of its patches, and back.

Pictures of a patch span its box by KHR_texture_transform. A mesh has a primitive for each patch it shows, all over the same drawn
vertices; in what order its triangles were, VISTEL_avatar keeps.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.patch import Patch, of_numbers, patch_of
from vistel.figure.formats.gltf_binary import INDICES, Binary, smallest
from vistel.figure.making.files.gltf import Document
from vistel.figure.making.pictures import alpha_of, decode

TRANSFORM = "KHR_texture_transform"
STRENGTH = "KHR_materials_emissive_strength"
_ROUGHNESS = 0.7
_LARGEST = 16384
"""Texels along a side of a picture that is read, at most."""
_PICTURES = ("finish", "normal", "glow_picture", "opacity")


def write_materials(into: Binary, avatar: Avatar) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """materials, textures, images and samplers of the tree, the first texture the avatar's, the first material the plain one; and
    what VISTEL_avatar keeps of each patch: numbers, and which image is which of its pictures."""
    pictures = [("skin", avatar.albedo)]
    kept: list[dict[str, Any]] = []

    def texture(field: str, array: NDArray[np.uint8], patch: Patch) -> dict[str, Any]:
        index = kept[-1][field] = len(pictures)
        pictures.append((f"patch {len(kept) - 1} {field}", array))
        u, v, right, top = patch.box
        wide, high = right - u, top - v
        # Their v goes down from the top of the picture.
        offset, scale = [-u / wide, -(1.0 - top) / high], [1.0 / wide, 1.0 / high]
        return {"index": index, "extensions": {TRANSFORM: {"offset": offset, "scale": scale}}}

    rows: list[dict[str, Any]] = [_plain("skin", _ROUGHNESS, 0.0)]
    for k, p in enumerate(avatar.patches):
        kept.append({"numbers": list(p.numbers)})
        row = _plain(f"patch {k}", 1.0 if p.finish is not None else p.roughness, 1.0 if p.finish is not None else p.metallic)
        if p.opacity is not None:
            kept[-1]["opacitySize"] = list(p.opacity.shape)
            row["pbrMetallicRoughness"]["baseColorTexture"] = texture("colour", with_alpha(avatar.albedo, p), p)
            row["alphaMode"] = "BLEND" if p.blend else "MASK"
            row |= {} if p.blend else {"alphaCutoff": p.cutoff}
        if p.finish is not None:
            row["occlusionTexture"] = texture("finish", p.finish, p)
            row["pbrMetallicRoughness"]["metallicRoughnessTexture"] = row["occlusionTexture"]
        if p.normal is not None:
            row["normalTexture"] = texture("normal", p.normal, p)
        if any(p.glow):
            most = max(1.0, *p.glow)
            row["emissiveFactor"] = [g / most for g in p.glow]
            row |= {"extensions": {STRENGTH: {"emissiveStrength": most}}} if most > 1.0 else {}
            if p.glow_picture is not None:
                row["emissiveTexture"] = texture("glow_picture", p.glow_picture, p)
        rows.append(row | ({"doubleSided": True} if p.both_sides else {}))
    tree = {
        "materials": rows,
        "textures": [{"source": i, "sampler": 0} for i in range(len(pictures))],
        "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}],
        "images": [into.image(p, n) for n, p in pictures],
    }
    return tree, kept


def read_patches(document: Document, kept: dict[str, Any]) -> tuple[Patch, ...]:
    """What `write_materials` kept. Raises MakingError for pictures that cannot be read, ValueError, KeyError, TypeError."""
    out: list[Patch] = []
    for row in kept.get("patches", []):
        found = {field: decode(document.picture(row[field]), _LARGEST) for field in _PICTURES if field in row}
        if "opacity" in found:  # a picture of its own, as older versions wrote
            found["opacity"] = np.ascontiguousarray(found["opacity"][..., 0])
        elif "opacitySize" in row:
            found["opacity"] = _opacity(document.picture(row["colour"]), row["opacitySize"])
        out.append(of_numbers([float(x) for x in row["numbers"]], found))
    return tuple(out)


def extensions_used(patches: tuple[Patch, ...]) -> list[str]:
    """The glTF extensions that the materials of these patches need."""
    moved = any(p.pictures for p in patches)
    return [TRANSFORM] * moved + [STRENGTH] * any(max(p.glow) > 1.0 for p in patches)


def primitives(into: Binary, avatar: Avatar, mesh: Mesh, shared: dict[str, Any]) -> tuple[list[dict[str, Any]], int | None]:
    """A primitive for each patch that a mesh shows, with what all of them share; and the accessor of the order in which the mesh
    has their triangles, None where that is theirs."""
    on = patch_of(avatar.patches, mesh.uv, mesh.corner_triangles)
    order = np.argsort(on, kind="stable")
    out: list[dict[str, Any]] = []
    for k in np.unique(on).tolist():
        corners = smallest(mesh.corner_triangles[order[on[order] == k]].reshape(-1, 1))
        out.append(shared | {"indices": into.accessor(corners, target=INDICES), "material": k + 1})
    if len(out) == 1:
        return out, None
    return out, into.accessor(smallest(order)[:, None], target=None)


def with_alpha(albedo: NDArray[np.uint8], patch: Patch) -> NDArray[np.uint8]:
    """(H, W, 4) the part of the avatar's texture that a patch covers, with the patch's opacity; as fine as the finer of the two."""
    assert patch.opacity is not None
    h, w = albedo.shape[:2]
    u, v, right, top = np.clip(patch.box, 0.0, 1.0).tolist()
    part = (u * w, (1.0 - top) * h, right * w, (1.0 - v) * h)
    high, wide = patch.opacity.shape
    size = max(wide, round(part[2] - part[0])), max(high, round(part[3] - part[1]))
    colour = Image.fromarray(albedo).resize(size, Image.Resampling.BILINEAR, box=part)
    colour.putalpha(Image.fromarray(patch.opacity).resize(size, Image.Resampling.NEAREST))
    return np.asarray(colour, np.uint8)


def _opacity(data: bytes, size: list[int]) -> NDArray[np.uint8]:
    """(H, W) what `with_alpha` put into a picture, of this size. Raises ValueError."""
    alpha, (high, wide) = alpha_of(data, _LARGEST), size
    if alpha is None or not (0 < high <= alpha.shape[0] and 0 < wide <= alpha.shape[1]):
        raise ValueError(f"a picture without the opacity {wide} by {high} that it should have")
    return np.asarray(Image.fromarray(alpha).resize((wide, high), Image.Resampling.NEAREST), np.uint8)


def _plain(name: str, roughness: float, metallic: float) -> dict[str, Any]:
    pbr = {"baseColorTexture": {"index": 0}, "metallicFactor": metallic, "roughnessFactor": roughness}
    return {"name": name, "pbrMetallicRoughness": pbr}

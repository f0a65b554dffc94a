"""The humanoid map of VRM 1.0 and 0.x: which joint of a file is which bone, in VISTEL's names and in VRM's."""

import re
from typing import Any

from vistel.figure.making.files.gltf import Document, as_list, as_object
from vistel.figure.making.names import SPINE
from vistel.figure.skeleton import JOINT_INDEX

TRUNK = {"spine": "spine_1", "chest": "spine_4", "upperChest": "spine_7"}
"""VRM's three joints of the trunk among VISTEL's eight."""
REQUIRED = (
    "hips",
    "spine",
    "head",
    *(f"{side}{bone}" for side in ("left", "right") for bone in ("UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand")),
)
"""Bones that VRM 1.0 requires."""


def humanoid(document: Document) -> dict[int, str]:
    """The house's joint (or SPINE) of each node that the file's humanoid map names; empty for plain glTF."""
    out: dict[int, str] = {}
    if (one := document.extension("VRMC_vrm")) is not None:
        bones = _inside(one, "humanoid", "humanBones")
        for name, bone in as_object(bones).items():
            _tell(out, bone, house_name(name))
    elif (zero := document.extension("VRM")) is not None:
        bones = _inside(zero, "humanoid", "humanBones")
        for bone in as_list(bones):
            _tell(out, bone, house_name(_of_one(str(as_object(bone).get("bone", "")))))
    return out


def version(document: Document) -> str:
    """ "VRM 1.0", "VRM 0.x" or "" for plain glTF."""
    if (one := document.extension("VRMC_vrm")) is not None:
        return f"VRM {one.get('specVersion', '1.0')}"
    return "VRM 0.x" if document.extension("VRM") is not None else ""


def house_name(bone: str) -> str | None:
    """The house's joint of a humanoid bone of VRM 1.0 (leftUpperArm: left_upper_arm), SPINE for those of the trunk."""
    if bone in TRUNK:
        return SPINE
    snake = re.sub(r"(?<=[a-z])([A-Z])", lambda m: "_" + m[1].lower(), bone)
    return snake if snake in JOINT_INDEX else None


def vrm_name(joint: str) -> str | None:
    """The humanoid bone of VRM 1.0 that a joint of the house is, None where VRM has none."""
    for bone, ours in TRUNK.items():
        if joint == ours:
            return bone
    if joint.startswith("spine_"):
        return None
    first, *rest = joint.split("_")
    return first + "".join(word.capitalize() for word in rest)


def _of_one(bone: str) -> str:
    """A bone of VRM 0.x under its name in 1.0, which names thumbs differently."""
    for side in ("left", "right"):
        if bone == f"{side}ThumbProximal":
            return f"{side}ThumbMetacarpal"
        if bone == f"{side}ThumbIntermediate":
            return f"{side}ThumbProximal"
    return bone


def _tell(out: dict[int, str], bone: Any, joint: str | None) -> None:
    node = as_object(bone).get("node")
    if joint is not None and isinstance(node, int):
        out.setdefault(node, joint)


def _inside(tree: dict[str, Any], *keys: str) -> Any:
    at: Any = tree
    for key in keys:
        at = as_object(at).get(key)
    return at

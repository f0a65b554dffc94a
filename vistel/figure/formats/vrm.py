"""What VRM 1.0 adds to an avatar's glTF: the humanoid map, whose it is, gaze, and expressions."""

from typing import Any

from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.face.rules import builtin_rules
from vistel.figure.face.targets import shapes_of
from vistel.figure.making.files.expressions import PREFIX
from vistel.figure.making.files.vrm import REQUIRED, vrm_name
from vistel.figure.skeleton import JOINT_INDEX, JOINTS

EYES = ("left_eye", "right_eye")
LICENCE = "https://vrm.dev/licenses/1.0/"
PRESETS: dict[str, dict[str, float]] = {
    "happy": {"AU6": 0.7, "AU12": 0.8},
    "angry": {"AU4": 1.0, "AU7": 0.5, "AU9": 0.3, "AU24": 0.6},
    "sad": {"AU1": 0.8, "AU4": 0.3, "AU15": 0.9, "AU17": 0.3},
    "relaxed": {"AU7": 0.3, "AU12": 0.35},
    "surprised": {"AU1": 0.9, "AU2": 0.9, "AU5": 0.8, "AU26": 0.35},
    "aa": {"AU26": 0.6, "AU16": 0.2},
    "ih": {"AU26": 0.15, "AU12": 0.15, "AU16": 0.3, "AU20": 0.5},
    "ou": {"AU26": 0.1, "AU18": 0.8},
    "ee": {"AU26": 0.3, "AU16": 0.2, "AU20": 0.4},
    "oh": {"AU26": 0.4, "AU22": 0.6},
    "blink": {"AU45": 1.0},
    "blinkLeft": {"left_AU45": 1.0},
    "blinkRight": {"right_AU45": 1.0},
}
"""Expressions of VRM as action units and how strong each is. Emotions: the units that Ekman and Friesen's manual of 1978 gives for
them; mouths of the five vowels: opening of the jaw, lips spread (ih, ee) or round (ou, oh)."""


def vrm_extension(avatar: Avatar, author: str) -> dict[str, Any]:
    """VRMC_vrm 1.0 of an avatar whose joints are the first nodes, its mesh the next. Raises ValueError for a joint that lacks."""
    bones = {bone: {"node": j} for j, joint in enumerate(JOINTS) if (bone := vrm_name(joint)) is not None}
    lacking = [bone for bone in REQUIRED if bone not in bones]
    if lacking:
        raise ValueError(f"no joint for {lacking[0]}, which VRM requires")
    head, eyes = avatar.skeleton.rest[JOINT_INDEX["head"]], [avatar.skeleton.rest[JOINT_INDEX[e]] for e in EYES]
    inner = {"inputMaxValue": 90.0, "outputScale": 30.0}
    shown = vrm_expressions(avatar.mesh, len(JOINTS))
    return {
        "specVersion": "1.0",
        "meta": {
            "name": avatar.name or "avatar",
            "version": "1",
            "authors": [author],
            "licenseUrl": LICENCE,
            "avatarPermission": "onlyAuthor",
            "commercialUsage": "personalNonProfit",
            "modification": "prohibited",
            "creditNotation": "required",
            "allowRedistribution": False,
        },
        "humanoid": {"humanBones": bones},
        "lookAt": {
            "offsetFromHeadBone": (0.5 * (eyes[0] + eyes[1]) - head).tolist(),
            "type": "bone",
            "rangeMapHorizontalInner": inner,
            "rangeMapHorizontalOuter": inner,
            "rangeMapVerticalDown": inner,
            "rangeMapVerticalUp": inner,
        },
    } | ({"expressions": shown} if shown else {})


def vrm_expressions(mesh: Mesh, node: int) -> dict[str, Any]:
    """VRM's presets, each made of those of the mesh's targets that show its action units, and every target under its own name as
    a custom expression; empty without targets. node: the glTF node of the mesh."""
    number = {t.name: k for k, t in enumerate(mesh.targets)}

    def expression(shares: dict[str, float]) -> dict[str, Any]:
        return {"morphTargetBinds": [{"node": node, "index": number[name], "weight": w} for name, w in shares.items()]}

    made = {name: _shares(mesh, units) for name, units in PRESETS.items()}
    out = {
        "preset": {name: expression(shares) for name, shares in made.items() if shares},
        "custom": {name: expression({name: 1.0}) for name in number if name not in PRESETS and not name.startswith(PREFIX)},
    }
    return {group: rows for group, rows in out.items() if rows}


def _shares(mesh: Mesh, units: dict[str, float]) -> dict[str, float]:
    """Weights of the targets that show these action units."""
    out: dict[str, float] = {}
    for one in builtin_rules().units:
        strong = units.get(one.name, units.get(one.unit.name))
        if strong is None:
            continue
        found, of_both = shapes_of(one, mesh.targets)
        if not (of_both and one.name in units):  # a target that shuts both eyes shows no wink
            out |= {t.name: strong for t in found}
    return out

"""VISTEL's names for the joints of other rigs: VRM, Mixamo, Unreal, MakeHuman, CMU, Blender."""

import re

from vistel.figure.skeleton import JOINT_INDEX

SPINE = "spine"
"""Any joint of the trunk between the hips and the neck."""

_TRUNK = {
    "hips": "hips pelvis hip lowerbody root_hips",
    SPINE: "spine chest upperchest torso abdomen lowerback waist upperbody lhipjoint rhipjoint",
    "neck": "neck neck01 neck1",
    "head": "head",
    "jaw": "jaw chin",
}
_SIDED = {
    "shoulder": "shoulder clavicle collar collarbone clavicula",
    "upper_arm": "upperarm arm uparm shoulderjoint armupper humerus",
    "lower_arm": "lowerarm forearm elbow armlower",
    "hand": "hand wrist fingerbase",
    "upper_leg": "upperleg upleg thigh legupper femur hipjointleg",
    "lower_leg": "lowerleg leg calf shin knee shank leglower",
    "foot": "foot ankle",
    "toes": "toes toe toebase ball",
    "eye": "eye eyeball faceeye",
}
_FINGERS = {"thumb": "thumb", "index": "index", "middle": "middle", "ring": "ring", "little": "little pinky"}
_PHALANGES = ("proximal", "intermediate", "distal")
_THUMB = ("metacarpal", "proximal", "distal")
_PREFIX = re.compile(r"^(.*:|mixamorig\d*|bip\d*|j_bip_|j_adj_|def[-_.]|bone[-_.]|cc_base_|valvebiped)+", re.IGNORECASE)

_WORDS = {word: joint for joint, words in _TRUNK.items() for word in words.split()}
_SIDE_WORDS = {word: joint for joint, words in _SIDED.items() for word in words.split()}


def house_joint(name: str) -> str | None:
    """The joint that a rig's joint of that name stands for, SPINE for any of the trunk, None for unknown names."""
    if name in JOINT_INDEX:
        return name
    bare = _PREFIX.sub("", name.strip()).lstrip("_-. ")
    side, rest = _side(bare)
    if side is None:
        return _trunk(rest)
    word = re.sub(r"[\s_.\-]", "", rest).lower()
    finger = _finger(word)
    if finger is not None:
        return f"{side}_{finger}"
    stem = re.sub(r"\d+$", "", word)
    joint = _SIDE_WORDS.get(word) or _SIDE_WORDS.get(stem)
    if joint is not None:
        return f"{side}_{joint}"
    return SPINE if word in ("hipjoint", "hip", "breast", "pectoral") else None


def _side(name: str) -> tuple[str | None, str]:
    """left, right or None, and the name without that."""
    for side, letter in (("left", "l"), ("right", "r")):
        for pattern in (
            rf"(?i)^{side}[\s_.\-]*",
            rf"(?i)[\s_.\-]*{side}$",
            rf"(?i)^{letter}[\s_.\-]+",
            rf"(?i)[\s_.\-]+{letter}$",
            rf"^[{letter}{letter.upper()}](?=[A-Z])",
            rf"(?i)[\s_.\-]+{letter}(?=[\s_.\-])",
        ):
            found = re.search(pattern, name)
            if found and found.end() - found.start() < len(name):
                return side, name[: found.start()] + name[found.end() :]
    return None, name


def _trunk(name: str) -> str | None:
    word = re.sub(r"[\s_.\-]", "", name).lower()
    return _WORDS.get(word) or _WORDS.get(re.sub(r"\d+$", "", word))


def _finger(word: str) -> str | None:
    """ "index_proximal" of "indexproximal", "index1", "handindex1", "index01", "findex1", "finger2-1" (MakeHuman)."""
    word = re.sub(r"^(hand|f(?=index|middle|ring|pinky|little|thumb))", "", word)
    numbered = re.fullmatch(r"finger(\d)(\d)", word)
    if numbered:
        which, at = int(numbered[1]) - 1, int(numbered[2]) - 1
        return _phalanx(list(_FINGERS)[which], at) if which < 5 and at < 3 else None
    for finger, words in _FINGERS.items():
        for stem in words.split():
            if not word.startswith(stem):
                continue
            tail = word[len(stem) :].removeprefix("finger")
            if tail in ("", "0"):
                return _phalanx(finger, 0)
            if tail.isdigit():
                at = int(tail) - 1
                return _phalanx(finger, at) if at < 3 else None
            names = _THUMB if finger == "thumb" else _PHALANGES
            return f"{finger}_{tail}" if tail in names else None
    return None


def _phalanx(finger: str, at: int) -> str:
    return f"{finger}_{(_THUMB if finger == 'thumb' else _PHALANGES)[at]}"

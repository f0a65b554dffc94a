"""The joint chain of a figure, as data.

Frames: right-handed, metres, Y up. In the rest pose (T-pose, palms down) the figure stands with its feet on
y = 0, faces +Z, its left arm points along +X, and *every joint frame is parallel to the model frame*
(the convention of VRM 1.0). A pose is one rotation per joint relative to its parent; identity is the rest pose.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64

SPINE_SEGMENTS = 8
FINGERS = ("thumb", "index", "middle", "ring", "little")
_DIGITS: dict[str, tuple[str, ...]] = dict.fromkeys(FINGERS, ("proximal", "intermediate", "distal"))
_DIGITS["thumb"] = ("metacarpal", "proximal", "distal")

COLLAR_SHORTENING = 0.18
"""Share of the collar bone's length lost with the arm overhead, in people not measured (mathematics M8.5)."""
REFERENCE_HEIGHT = 1.75
"""Height in metres of the person whose proportions `_REFERENCE` holds."""


def _reference() -> list[tuple[str, str | None, tuple[float, float, float]]]:
    """(joint, parent, position in the model frame) for a person of REFERENCE_HEIGHT, right side mirrored."""
    hips_y, spine_length = 0.94, 0.50
    rows: list[tuple[str, str | None, tuple[float, float, float]]] = [("hips", None, (0.0, hips_y, 0.0))]
    for k in range(1, SPINE_SEGMENTS + 1):
        parent = "hips" if k == 1 else f"spine_{k - 1}"
        rows.append((f"spine_{k}", parent, (0.0, hips_y + (k - 1) * spine_length / SPINE_SEGMENTS, 0.0)))
    top = hips_y + spine_length
    rows += [
        ("neck", f"spine_{SPINE_SEGMENTS}", (0.0, top + 0.03, 0.0)),
        ("head", "neck", (0.0, top + 0.13, 0.015)),
        ("jaw", "head", (0.0, top + 0.135, 0.03)),
        ("left_eye", "head", (0.032, top + 0.205, 0.085)),
        ("right_eye", "head", (-0.032, top + 0.205, 0.085)),
    ]
    side: list[tuple[str, str, tuple[float, float, float]]] = [
        ("shoulder", f"spine_{SPINE_SEGMENTS}", (0.02, top - 0.03, 0.02)),
        ("upper_arm", "shoulder", (0.18, top - 0.03, 0.0)),
        ("lower_arm", "upper_arm", (0.47, top - 0.03, 0.0)),
        ("hand", "lower_arm", (0.73, top - 0.03, 0.0)),
        ("upper_leg", "hips", (0.09, hips_y - 0.02, 0.0)),
        ("lower_leg", "upper_leg", (0.09, 0.50, 0.0)),
        ("foot", "lower_leg", (0.09, 0.08, 0.0)),
        ("toes", "foot", (0.09, 0.02, 0.13)),
    ]
    y = top - 0.03
    knuckles = {"index": (0.095, 0.027), "middle": (0.098, 0.006), "ring": (0.092, -0.014), "little": (0.083, -0.033)}
    bones = {"index": (0.042, 0.025), "middle": (0.046, 0.028), "ring": (0.042, 0.026), "little": (0.033, 0.020)}
    thumb = ((0.022, -0.008, 0.026), (0.056, -0.012, 0.052), (0.083, -0.014, 0.070))
    for digit, (dx, dy, dz) in zip(_DIGITS["thumb"], thumb, strict=True):
        parent = "hand" if digit == "metacarpal" else f"thumb_{_DIGITS['thumb'][_DIGITS['thumb'].index(digit) - 1]}"
        side.append((f"thumb_{digit}", parent, (0.73 + dx, y + dy, dz)))
    for finger, (reach, across) in knuckles.items():
        x = 0.73 + reach
        for digit, step in zip(_DIGITS[finger], (0.0, *bones[finger]), strict=True):
            x += step
            before = {"proximal": "hand", "intermediate": f"{finger}_proximal", "distal": f"{finger}_intermediate"}
            parent = before[digit]
            side.append((f"{finger}_{digit}", parent, (x, y, across)))
    paired = {name for name, _, _ in side}
    for prefix, sign in (("left", 1.0), ("right", -1.0)):
        for name, parent, (px, py, pz) in side:
            parent_name = f"{prefix}_{parent}" if parent in paired else parent
            rows.append((f"{prefix}_{name}", parent_name, (sign * px, py, pz)))
    return rows


_REFERENCE = _reference()
JOINTS: tuple[str, ...] = tuple(name for name, _, _ in _REFERENCE)
"""All joint names, parents before children."""
JOINT_INDEX: dict[str, int] = {name: i for i, name in enumerate(JOINTS)}
PARENTS: NDArray[np.int32] = np.array([-1 if p is None else JOINT_INDEX[p] for _, p, _ in _REFERENCE], np.int32)
"""Parent index of each joint, -1 for the hips."""
_CROWN_BASE = _REFERENCE[JOINT_INDEX["head"]][2][1]
"""Height of the reference's head joint [m]."""


def finger_joints(side: str) -> tuple[str, ...]:
    """The 15 finger joints of `side` ("left" or "right"), thumb first, root to tip."""
    return tuple(f"{side}_{finger}_{digit}" for finger in FINGERS for digit in _DIGITS[finger])


@dataclass(frozen=True)
class Skeleton:
    """A person's joint chain in the rest pose.

    rest: (J, 3) joint positions in the model frame [m]; names and parents are JOINTS and PARENTS.
    tip: (J, 3) vector in the joint frame from the joint to the end of its bone [m] (next joint, fingertip, crown).
    collar_shortening: share of the collar bone's length lost with the arm overhead.
    """

    rest: F64
    tip: F64
    collar_shortening: float = COLLAR_SHORTENING

    @cached_property
    def offsets(self) -> F64:
        """(J, 3) position of each joint in its parent's frame [m]; the hips keep their model position."""
        out = self.rest.copy()
        out[1:] -= self.rest[PARENTS[1:]]
        return out

    def length(self, joint: str, child: str) -> float:
        """Rest distance between two joints [m]."""
        return float(np.linalg.norm(self.rest[JOINT_INDEX[child]] - self.rest[JOINT_INDEX[joint]]))

    @property
    def height(self) -> float:
        """Standing height: crown of the head above the soles [m]."""
        head = JOINT_INDEX["head"]
        return float(self.rest[head, 1] + self.tip[head, 1])

    @cached_property
    def upper_arm(self) -> float:
        """Length from shoulder joint to elbow [m]."""
        return self.length("left_upper_arm", "left_lower_arm")

    @cached_property
    def lower_arm(self) -> float:
        """Length from elbow to wrist [m]."""
        return self.length("left_lower_arm", "left_hand")

    @cached_property
    def upper_leg(self) -> float:
        """Length from hip joint to knee [m]."""
        return self.length("left_upper_leg", "left_lower_leg")

    @cached_property
    def lower_leg(self) -> float:
        """Length from knee to ankle [m]."""
        return self.length("left_lower_leg", "left_foot")

    @cached_property
    def spine(self) -> float:
        """Length of the eight spinal segments together, hips to the base of the neck's parent [m]."""
        return self.length("spine_1", "spine_8") * SPINE_SEGMENTS / (SPINE_SEGMENTS - 1)


def standard_skeleton(height: float = REFERENCE_HEIGHT, shoulder_breadth: float = 1.0) -> Skeleton:
    """A person of `height` metres with average proportions; `shoulder_breadth` scales the collar bones.

    Raises ValueError when the height is not a plausible person's (0.5 to 2.6 m).
    """
    if not 0.5 <= height <= 2.6:
        raise ValueError(f"height: expected 0.5 to 2.6 m, got {height}")
    rest = np.array([p for _, _, p in _REFERENCE], np.float64)
    for side in ("left", "right"):
        arm = JOINT_INDEX[f"{side}_upper_arm"]
        shift = (shoulder_breadth - 1.0) * (rest[arm, 0] - rest[JOINT_INDEX[f"{side}_shoulder"], 0])
        for j in range(arm, len(JOINTS)):
            if _is_below(j, arm):
                rest[j, 0] += shift
    rest *= height / REFERENCE_HEIGHT
    return Skeleton(rest, _tips(rest, height))


def measured_skeleton(standard: Skeleton, offsets: Mapping[str, F64], collar_shortening: float = COLLAR_SHORTENING) -> Skeleton:
    """`standard` with the bones of a measured person: (3,) from parent to joint [m], rest pose, by joint name."""
    rest = standard.rest.copy()
    if "hips" in offsets:
        rest[0] = offsets["hips"]
    for j in range(1, len(JOINTS)):
        rest[j] = rest[PARENTS[j]] + offsets.get(JOINTS[j], standard.offsets[j])
    return Skeleton(rest, _tips(rest, standard.height), collar_shortening)


def _tips(rest: F64, height: float) -> F64:
    """(J, 3) ends of the bones of a person `height` metres tall; see Skeleton.tip."""
    scale = height / REFERENCE_HEIGHT
    tip = np.zeros_like(rest)
    for j in range(1, len(JOINTS)):
        parent = int(PARENTS[j])
        if JOINTS[parent] not in ("hips", "head") and (JOINTS[j] == "neck" or not tip[parent].any()):
            tip[parent] = rest[j] - rest[parent]
    tip[JOINT_INDEX["hips"]] = rest[JOINT_INDEX["spine_1"]] - rest[JOINT_INDEX["hips"]] + (0, 0.02 * scale, 0)
    tip[JOINT_INDEX["head"]] = (0.0, (REFERENCE_HEIGHT - _CROWN_BASE) * scale, 0.0)
    tip[JOINT_INDEX["jaw"]] = (0.0, -0.03 * scale, 0.07 * scale)
    for side in ("left", "right"):
        sign = 1.0 if side == "left" else -1.0
        tip[JOINT_INDEX[f"{side}_eye"]] = (0.0, 0.0, 0.012 * scale)
        tip[JOINT_INDEX[f"{side}_toes"]] = (0.0, 0.0, 0.07 * scale)
        hand = JOINT_INDEX[f"{side}_hand"]
        tip[hand] = rest[JOINT_INDEX[f"{side}_middle_proximal"]] - rest[hand]
        tip[JOINT_INDEX[f"{side}_thumb_distal"]] = (sign * 0.018 * scale, -0.002 * scale, 0.020 * scale)
        for finger, last in (("index", 0.022), ("middle", 0.024), ("ring", 0.023), ("little", 0.020)):
            tip[JOINT_INDEX[f"{side}_{finger}_distal"]] = (sign * last * scale, 0.0, 0.0)
    return tip


def _is_below(joint: int, ancestor: int) -> bool:
    while joint >= 0:
        if joint == ancestor:
            return True
        joint = int(PARENTS[joint])
    return False

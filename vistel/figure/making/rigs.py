"""A file's rig in terms of VISTEL's joints."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.figure.making.names import SPINE, house_joint
from vistel.figure.making.source import Rig


@dataclass(frozen=True)
class Known:
    """at: places of our joints, in the file's frame; joint_of: by the rig's names; joint_of_column: by its columns of
    weights, joints without a name of ours going with the nearest above them that has one; unknown: their names."""

    count: int
    at: Mapping[str, F64]
    joint_of: Mapping[str, str]
    joint_of_column: Mapping[int, str]
    unknown: tuple[str, ...]
    weight: F32 | None

    def gaze(self, triangles: I32) -> NDArray[np.bool_] | None:
        """(F,) faces whose corners follow the joint of an eye alone; None without such a joint."""
        eyes = [c for c, name in self.joint_of_column.items() if name.endswith("_eye")]
        if self.weight is None or len(eyes) < 2:
            return None
        return np.asarray((self.weight[:, eyes].sum(axis=1) > 0.95)[triangles].all(axis=1), np.bool_)

    def head(self) -> F64 | None:
        """(3,) from the feet to the head, None where the rig has none."""
        feet = [self.at[f"{side}_foot"] for side in ("left", "right") if f"{side}_foot" in self.at]
        top = self.at.get("head", self.at.get("neck"))
        return None if top is None or not feet else top - np.mean(feet, axis=0)

    def left(self) -> F64 | None:
        """(3,) from the right arm to the left one, None where the rig has none."""
        if "left_upper_arm" in self.at and "right_upper_arm" in self.at:
            return self.at["left_upper_arm"] - self.at["right_upper_arm"]
        return None


def mapped(rig: Rig | None) -> Known:
    """What is known of a rig."""
    if rig is None:
        return Known(0, {}, {}, {}, (), None)
    at: dict[str, F64] = {}
    joint_of: dict[str, str] = {}
    column: dict[int, str] = {}
    unknown: list[str] = []
    shared = _prefix(rig.names)
    for i, name in enumerate(rig.names):
        ours = rig.told.get(i) or house_joint(name) or house_joint(name.removeprefix(shared))
        if ours is None:
            unknown.append(name)
            continue
        column[i] = ours
        joint_of[name] = ours
        if ours != SPINE and ours not in at:
            at[ours] = rig.at[i]
    for i in range(len(rig.names)):
        j = i
        while j >= 0 and j not in column:
            j = int(rig.parents[j])
        if i not in column and j >= 0:
            column[i] = column[j]
    return Known(len(rig.names), at, joint_of, column, tuple(unknown), rig.weight)


def _prefix(names: Sequence[str]) -> str:
    """What all names begin with, up to a separator: the name of the figure, as some programs put it."""
    first, last = min(names, default=""), max(names, default="")
    if first == last:
        return ""
    shared = first[: next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), len(first))]
    return shared[: max(shared.rfind(c) for c in "_:.-| ") + 1]

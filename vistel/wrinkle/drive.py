"""What drives wrinkles: a joint's angle or an action unit, through a curve that is data (Singh §5.3.1; mathematics M9.5)."""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX, PARENTS
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.geometry.smoothstep import ease
from vistel.wrinkle.errors import Entry

Finite = Annotated[float, Field(allow_inf_nan=False)]
Unit = Annotated[float, Field(ge=0.0, le=1.0)]


class DriveCurve(Entry):
    """The weight of a set of wrinkles, 0 to 1, as a function of what drives it."""

    knots: Annotated[list[tuple[Finite, Unit]], Field(min_length=2, max_length=32)]
    """Value and weight, values rising: degrees of a joint, or the intensity of an action unit, 0..1."""
    form: Literal["linear", "smooth"] = "smooth"
    """Between knots: straight, or the Hermite blend, which is level at each."""

    @model_validator(mode="after")
    def _rises(self) -> "DriveCurve":
        values = [v for v, _ in self.knots]
        if any(b <= a for a, b in pairwise(values)):
            raise ValueError(f"the knots' values are {', '.join(f'{v:g}' for v in values)}; expected each above the one before")
        return self

    def __call__(self, value: float) -> float:
        """The weight at a value; beyond the knots that of the outermost."""
        at, weight = zip(*self.knots, strict=True)
        if not math.isfinite(value) or value <= at[0]:
            return float(weight[0])
        if value >= at[-1]:
            return float(weight[-1])
        k = int(np.searchsorted(at, value, side="right")) - 1
        t = (value - at[k]) / (at[k + 1] - at[k])
        t = ease(t) if self.form == "smooth" else t
        return float(weight[k] + t * (weight[k + 1] - weight[k]))


class Drive(Entry):
    """A joint or an action unit, and the curve from it to a weight."""

    joint: str | None = None
    """Its rotation relative to its parent drives; without left_ and right_ where the region has two sides."""
    axis: tuple[Finite, Finite, Finite] | None = None
    """Only the part of the rotation about this axis (left side; mirrored on the right), signed; the whole angle otherwise."""
    action: str | None = None
    """An action unit such as "AU1"; without side where the region has two."""
    curve: DriveCurve

    @model_validator(mode="after")
    def _one_driver(self) -> "Drive":
        if (self.joint is None) == (self.action is None):
            raise ValueError("give a joint or an action, one of the two")
        if self.axis is not None and not any(self.axis):
            raise ValueError("axis is zero")
        if self.joint is not None and not any(side + self.joint in JOINT_INDEX for side in ("", "left_")):
            raise ValueError(f"there is no joint {self.joint!r}")
        return self

    def value(self, joints: JointPose, actions: Mapping[str, float], side: str = "") -> float:
        """Degrees of the joint, or the action unit's intensity (0 where unknown)."""
        if self.action is not None:
            return actions.get(side + self.action, actions.get(self.action, 0.0))
        name = side + str(self.joint)
        joint = JOINT_INDEX[name if name in JOINT_INDEX else str(self.joint)]
        mirror = side == "right_"
        return math.degrees(rotation_angle(joints, joint, self.axis, mirror=mirror))

    def weight(self, joints: JointPose, actions: Mapping[str, float], side: str = "") -> float:
        """The weight of the wrinkles, 0..1."""
        return self.curve(self.value(joints, actions, side))


def rotation_angle(joints: JointPose, joint: int, axis: tuple[float, float, float] | None = None, *, mirror: bool = False) -> float:
    """Rotation of a joint relative to its parent [rad]: 2 acos |q.w|, 0..pi; about an axis of the joint's frame, signed,
    -pi..pi. mirror: the axis as seen in a mirror that swaps left and right."""
    parent = PARENTS[joint]
    local = joints.rotation[joint] if parent < 0 else joints.rotation[parent].T @ joints.rotation[joint]
    q = quaternion_from_matrix(np.ascontiguousarray(local))
    if axis is None:
        return 2.0 * math.acos(min(1.0, abs(float(q[3]))))
    # A rotation vector is mirrored as a pseudovector: its component normal to the mirror keeps its sign.
    a = np.array(axis) * ((1.0, -1.0, -1.0) if mirror else (1.0, 1.0, 1.0))
    return 2.0 * math.atan2(float(q[:3] @ a) / float(np.linalg.norm(a)), float(q[3]))

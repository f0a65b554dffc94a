"""Eye positions and viewing directions of people."""

from collections.abc import Iterable
from dataclasses import dataclass

from vistel.arrays import F64
from vistel.figure.skeleton import JOINT_INDEX
from vistel.space.people import Posed

_HEAD = JOINT_INDEX["head"]
_LEFT = JOINT_INDEX["left_eye"]
_RIGHT = JOINT_INDEX["right_eye"]


@dataclass(frozen=True)
class Eyes:
    """position: (3,) midway between the eyes [m]; facing: (3,) unit vector out of the face. Room frame."""

    position: F64
    facing: F64


def eyes_of(people: Iterable[Posed]) -> dict[str, Eyes]:
    """The eyes of each person by name, in the given order."""
    out: dict[str, Eyes] = {}
    for posed in people:
        joints = posed.joints
        out[posed.name] = Eyes(0.5 * (joints.position[_LEFT] + joints.position[_RIGHT]), joints.rotation[_HEAD][:, 2])
    return out

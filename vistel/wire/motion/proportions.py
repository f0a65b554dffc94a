"""The message Proportions, to and from plain lists."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.v1.motion_pb2 import Proportions

_NUMBERS = ("rest", "tip", "a", "b", "radius_a", "radius_b")


def to_message(names: Sequence[str], joint: Sequence[int], arrays: Sequence[NDArray[np.float64]]) -> Proportions:
    """arrays: rest, tip (J, 3), a, b (P, 3), radius_a, radius_b (P,), metres."""
    numbers = {name: array.ravel().tolist() for name, array in zip(_NUMBERS, arrays, strict=True)}
    return Proportions(names=names, joint=joint, **numbers)


def from_message(message: Proportions) -> dict[str, Any]:
    """The message's lists by their field; nothing is checked but what protobuf checks."""
    return {"names": list(message.names), "joint": list(message.joint)} | {n: list(getattr(message, n)) for n in _NUMBERS}

"""How a figure moves, as an animation of glTF 2.0."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.figure.formats.gltf_binary import Binary

_STILL_M = 1e-6
"""A joint that moves less against its parent keeps its place at rest [m]."""


@dataclass(frozen=True, eq=False)
class Movement:
    """times (N,) [s], ascending; position (N, J, 3) [m] and quaternion (N, J, 4) of joints in their parents' frames, the hips in
    the room's; shapes: the share (N,), 0 to 1, of morph targets by name."""

    times: F64
    position: F64
    quaternion: F64
    shapes: Mapping[str, F64]


def animation(binary: Binary, movement: Movement, name: str, skin: int, targets: Sequence[str]) -> dict[str, Any]:
    """Entry of `animations`, where nodes 0 to J - 1 are the joints. skin: the node whose mesh has the morph targets `targets`."""
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []
    times = binary.accessor(movement.times.astype(np.float32)[:, None], target=None, bounds=True)

    def add(node: int, path: str, values: F64) -> None:
        output = binary.accessor(values.astype(np.float32), target=None)
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        samplers.append({"input": times, "output": output})

    for j in range(movement.position.shape[1]):
        add(j, "rotation", movement.quaternion[:, j])
        if j == 0 or np.ptp(movement.position[:, j], axis=0).max() > _STILL_M:
            add(j, "translation", movement.position[:, j])
    if targets:
        still = np.zeros(len(movement.times))
        shares = np.column_stack([movement.shapes.get(target, still) for target in targets])
        add(skin, "weights", shares.reshape(-1, 1))
    return {"name": name, "samplers": samplers, "channels": channels}

"""What is seen between parted lips is painted only on heads whose mouth is painted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vistel.figure import builtin
from vistel.figure.avatar.atlas_kernels import rasterise
from vistel.wrinkle.opening import between_the_lips

TEXELS = 512


def test_lips_of_a_head_with_a_mouth_of_its_own_stay_as_they_are() -> None:
    avatar = builtin("ben").avatar
    owner, weight = rasterise(avatar.mesh.uv.astype(np.float64), avatar.mesh.corner_triangles.astype(np.int64), TEXELS)
    shares = np.dstack((weight, 1.0 - weight.sum(axis=2))).reshape(-1, 3)
    assert len(between_the_lips(avatar, owner.ravel(), shares)[0]) == 0
    painted = replace(avatar, mesh=replace(avatar.mesh, targets=()))
    texels, light = between_the_lips(painted, owner.ravel(), shares)
    assert len(texels) > 20
    assert light.min() < 0.2

"""How far eyes, brows and mouth stand out from the skin of a face, in a picture."""

import math

import cv2
import numpy as np

from vistel.arrays import F64, U8

SMALLEST = 12.0
"""Faces of less pixels from one eye to the other turned to us, if they were turned to us, are not measured."""
EYES_APART = 0.063
"""Metres."""
ABOVE, MOUTH = 0.023, 0.072
"""From the middle of the eyes up to the brows and down to the mouth [m]."""
CHEEK = 0.035
"""From an eye down to the cheek [m]."""
NEAR = 0.016
"""Half the side of the square that is looked at for a feature [m]."""


def contrasts(picture: U8, eyes: F64, pixels_per_m: float) -> dict[str, float]:
    """Share of the skin's lightness (CIELAB's L*) by which the darkest tenth of eyes, brows and mouth is darker than the median of
    the cheeks. picture: (height, width, 3); eyes: (2, 2) pixels. Raises ValueError for eyes in the same place."""
    apart = eyes[0] - eyes[1]
    across = apart / np.linalg.norm(apart)
    down = np.array((-across[1], across[0]))
    if down[1] < 0.0:
        down = -down
    lightness = cv2.cvtColor(picture.astype(np.float32) / 255.0, cv2.COLOR_RGB2LAB)[..., 0]
    half = max(1.0, NEAR * pixels_per_m)
    middle = eyes.mean(axis=0)

    def around(at: F64, wide: float = 1.0) -> F64:
        x, y = at
        rows = slice(max(0, math.floor(y - half)), math.ceil(y + half) + 1)
        columns = slice(max(0, math.floor(x - wide * half)), math.ceil(x + wide * half) + 1)
        return lightness[rows, columns].ravel().astype(np.float64)

    skin = np.median(np.concatenate([around(eye + CHEEK * pixels_per_m * down) for eye in eyes]))
    features = {
        "eyes": np.concatenate([around(eye) for eye in eyes]),
        "brows": np.concatenate([around(eye - ABOVE * pixels_per_m * down) for eye in eyes]),
        "mouth": around(middle + MOUTH * pixels_per_m * down, 1.5),
    }
    return {name: 1.0 - float(np.quantile(values, 0.1) / max(skin, 1.0)) for name, values in features.items()}

"""Where a figure is bare skin, which light goes into: on head, neck and hands, as far as its picture has the colour of its face
there. Hair, a collar and a cuff lie on the same limbs."""

import numpy as np
from numpy.typing import NDArray

from vistel.figure.avatar.avatar import Avatar, flesh

BARE = ("neck", "skull", "face", "palm", "knuckles", "thumb", "index", "middle", "ring", "little")
# How far bare skin strays from what the face mostly is, in logarithms.
PALER = 0.17
"""Of red to green, downwards: grey hair and cloth are paler than skin."""
REDDER = 0.45
"""Of red to green, upwards: lips are redder."""
YELLOWER = 0.26
"""Of green to blue, either way."""
DARKER = 0.8
"""Of brightness, downwards: corners that no light reaches."""
LIGHTER = 0.6
"""Of brightness, upwards: nails and the bridge of a nose."""


def is_bare(limb: str) -> bool:
    """Whether a limb of that name is bare, where hair and clothes leave it free."""
    return any(word in limb for word in BARE)


def bare_skin(avatar: Avatar) -> NDArray[np.bool_]:
    """(R,) which drawn vertices of the avatar's skin show bare skin."""
    mesh, names = avatar.mesh, avatar.body.names
    limb = mesh.limb[mesh.corner_vertex]
    bare = np.array([is_bare(n) for n in names])[limb] & flesh(avatar)[mesh.corner_vertex]
    face = bare & (np.array(names) == "face")[limb]
    if not face.any():
        return bare
    height, width = avatar.albedo.shape[:2]
    column = np.clip((mesh.uv[:, 0] % 1.0) * width, 0, width - 1).astype(np.int64)
    row = np.clip((1.0 - mesh.uv[:, 1] % 1.0) * height, 0, height - 1).astype(np.int64)
    red, green, blue = np.log(avatar.albedo[row, column].astype(np.float64) + 4.0).T
    bright = (red + green + blue) / 3.0
    # Not the inside of a mouth, nor brows and lashes.
    plain = face & (bright >= np.median(bright[face]))
    redness, yellowness, light = (values - np.median(values[plain]) for values in (red - green, green - blue, bright))
    alike = (redness > -PALER) & (redness < REDDER) & (np.abs(yellowness) < YELLOWER) & (light > -DARKER) & (light < LIGHTER)
    return bare & alike

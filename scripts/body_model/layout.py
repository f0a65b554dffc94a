"""Where the skin lies in the texture: MakeHuman's charts, moved and enlarged, because its eyes and lips are a few texels wide.

The texture is twice as wide as high. Its left half holds the body's charts, and in a column beside them eyeball, mouth, teeth,
tongue and lashes; the right half the head's chart, its face enlarged most."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from vistel.arrays import F64, I32

EYE_BOX = (0.390, 0.770, 0.495, 0.980)
"""Of an eyeball from the front: lowest u and v, highest u and v."""
_COLUMN = {  # lowest u and v, highest u and v
    "helper-tongue": (0.390, 0.660, 0.440, 0.760),
    "helper-upper-teeth": (0.390, 0.555, 0.495, 0.645),
    "helper-lower-teeth": (0.390, 0.455, 0.495, 0.545),
    "mouth": (0.390, 0.200, 0.495, 0.335),
}
LASHES = (0.390, 0.345, 0.495, 0.445)
"""Box of lashes: of the lower lids in its upper half, of the upper lids in its lower half."""
_LID = {"eyelashes-1": (0.390, 0.396, 0.495, 0.445), "eyelashes-2": (0.390, 0.345, 0.495, 0.394)}
_BODY = 0.275, 0.72
"""Where v = 0 of the trunk's chart lies, and how much lower it is: clothes cover most of it."""
_HANDS = (0.002, 0.004, 0.190, 0.365), (0.195, 0.004, 0.383, 0.365)
"""Larger than MakeHuman has them: hands are bare."""
_FEET = (0.135, 0.378, 0.185, 0.450), (0.190, 0.378, 0.240, 0.450)
_FACE = (0.885, 0.484)
"""Middle of the face in MakeHuman's coordinates."""
_REACH = (0.245, 0.337)
_MORE = 1.3
"""So much is the face enlarged beside the back of the head."""
_MARGIN = 0.004


BOXES = {name.removeprefix("helper-").replace("-", "_"): box for name, box in _COLUMN.items()} | {"eye": EYE_BOX, "lashes": LASHES}
"""Of what is painted as a rectangle, for the file."""


def islands(uv_triangles: I32, count: int) -> I32:
    """(F,) number of the island of texture coordinates that each triangle is on."""
    ends = np.concatenate([uv_triangles[:, [0, 1]], uv_triangles[:, [1, 2]]])
    label = connected_components(coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count)), directed=False)[1]
    return np.asarray(label[uv_triangles[:, 0]], np.int32)


def laid_out(group: list[str], uv: F64, island: I32) -> F64:
    """(F, 3, 2) coordinates of triangles in our texture. group: name of each triangle's group; uv: (F, 3, 2) MakeHuman's; of
    lashes: across the eye and from root to tip."""
    out = np.empty_like(uv)
    name = np.array(group)
    body = name == "body"
    for number in np.unique(island[body]):
        mine = body & (island == number)
        low, high = uv[mine].min(axis=(0, 1)), uv[mine].max(axis=(0, 1))
        if high[0] > 0.95:
            out[mine] = _head(uv[mine])
        elif low[0] > 0.70:
            out[mine] = _into(uv[mine], low, high, _COLUMN["mouth"])
        elif high[1] < 0.25:
            side = int(low[0] + high[0] > (0.36 if high[0] < 0.4 else 1.1))
            out[mine] = _into(uv[mine], low, high, (_HANDS if high[0] > 0.4 else _FEET)[side])
        else:
            out[mine] = uv[mine] * (0.5, _BODY[1]) + (0.0, _BODY[0])
    for word, box in _LID.items():
        mine = np.char.endswith(name, word)
        out[mine] = _into(uv[mine], np.zeros(2), np.ones(2), box)
    for word, box in _COLUMN.items():
        mine = np.char.endswith(name, word)
        if mine.any():
            out[mine] = _into(uv[mine], uv[mine].min(axis=(0, 1)), uv[mine].max(axis=(0, 1)), box)
    return out


def _head(uv: F64) -> F64:
    t = (uv - _FACE) / _REACH
    t = t * (1.0 + _MORE) / (1.0 + _MORE * np.abs(t))
    low, high = t.min(axis=(0, 1)), t.max(axis=(0, 1))
    return _into(t, low, high, (0.5 + _MARGIN, _MARGIN, 1.0 - _MARGIN, 1.0 - _MARGIN))


def _into(uv: F64, low: F64, high: F64, box: tuple[float, float, float, float]) -> F64:
    return np.array(box[:2]) + (uv - low) / (high - low) * np.subtract(box[2:], box[:2])

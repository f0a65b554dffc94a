"""Masks of the skin's parts in the texture: those that MakeHuman draws, and those that follow from where a texel lies on the
body."""

import numpy as np

from scripts.body_model.raster import rasterise
from scripts.body_model.skin_masks import places, skin_masks
from scripts.body_model.wheel import Wheel
from vistel.arrays import F64, I32, U8
from vistel.geometry.smoothstep import smooth

HEIGHT = 1024
"""Texels of the texture's height; it is twice as wide."""
_DRAWN = {"lips": "lips", "nails": "fingernails", "toenails": "toenails", "inside": "inside-mouth"}
_SOURCE = 2048
_CREW = 0.012
"""How far below the neck joint a shirt's collar lies in front [m]."""


def masks(wheel: Wheel, points: F64, joints: dict[str, F64], triangles: I32, uv: F64, old_uv: F64, arm: F64) -> dict[str, U8]:
    """(H, 2 H) by name, 0 to 255, first row at the top. points: (V, 3) of a usual person as MakeHuman has them; triangles: (F, 3)
    of the closed skin; uv, old_uv: (F, 3, 2) in our texture and in MakeHuman's; arm: (V,) share of the arms' joints in a vertex."""
    owner, share = rasterise(uv * (2 * HEIGHT, HEIGHT), (HEIGHT, 2 * HEIGHT))
    on = owner >= 0

    def over(values: F64) -> F64:
        """Corner values (F, 3, ...) at the texels that show something."""
        return np.einsum("nk,nk...->n...", share[on], values[owner[on]])

    corner = points[triangles]
    flat, normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), np.zeros_like(points)
    for k in range(3):
        np.add.at(normal, triangles[:, k], flat)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    at, old = over(points[triangles]), over(old_uv)
    found = {name: _sampled(wheel.mask(file, _SOURCE), old) for name, file in _DRAWN.items()}
    found["nails"] = np.maximum(found["nails"], found.pop("toenails"))
    found |= (
        _brows(at, joints)
        | _scalp(at, joints)
        | skin_masks(at, over(normal[triangles]), joints)
        | _clothes(at, joints, over(arm[triangles]))
    )
    out: dict[str, U8] = {}
    for name, value in found.items():
        out[name] = np.zeros(on.shape, np.uint8)
        out[name][on] = np.round(255 * np.clip(value, 0.0, 1.0)).astype(np.uint8)
    out["skin"] = np.where(on, 255, 0).astype(np.uint8)
    return out


def _sampled(mask: U8, uv: F64) -> F64:
    x, y = (uv[:, 0] * _SOURCE).astype(int).clip(0, _SOURCE - 1), ((1.0 - uv[:, 1]) * _SOURCE).astype(int).clip(0, _SOURCE - 1)
    return mask[y, x] / 255.0


def _brows(p: F64, joints: dict[str, F64]) -> dict[str, F64]:
    """An arc over each eye, thick at its inner end; 1 in its middle, falling to 0 at the farthest hairs."""
    x, y, z = places(p, joints).T
    u = (x - joints["left_eye"][0] + 0.019) / 0.046  # 0 at the inner end, 1 at the outer
    middle = 0.0204 + 0.0044 * np.sin(np.clip(u, 0.0, 1.0) * 2.35) - 0.0080 * np.clip(u - 0.58, 0.0, 1.0)
    half = 0.0056 - 0.0034 * np.clip(u, 0.0, 1.0) ** 1.4
    across = np.clip(1.25 - np.abs(y - middle) / half, 0.0, 1.0)
    return {"brows": across * smooth(5.0 * u + 0.5) * smooth(5.0 * (1.0 - u)) * (z > -0.01)}


def _scalp(p: F64, joints: dict[str, F64]) -> dict[str, F64]:
    """Where hair grows: above the forehead, behind the ears, down to the nape; and the beard."""
    eye, head, jaw = joints["left_eye"], joints["head"], joints["jaw"]
    x, y, z = np.abs(p[:, 0]), p[:, 1] - eye[1], p[:, 2] - eye[2]
    # The hairline: from the forehead's middle down before the ear, then behind it to the nape.
    front = np.interp(-z, (-0.03, 0.005, 0.035, 0.058, 0.085, 0.115, 0.2), (0.078, 0.066, 0.040, -0.004, -0.004, -0.050, -0.075))
    hair = smooth((y - front - 0.35 * np.maximum(0.0, 0.03 - x) * (z > -0.02)) / 0.012)
    below = (p[:, 1] < eye[1] - 0.035) & (z > -0.075)
    chin = smooth((eye[1] - 0.037 - 0.55 * np.maximum(0.0, x - 0.045) * 0.0 - p[:, 1]) / 0.018)
    side = smooth((x - 0.030) / 0.02)
    beard = chin * np.where(z > -0.02, 1.0, side) * smooth((z + 0.078) / 0.02) * smooth((y + 0.165) / 0.03) * below
    # Cheeks are free above a line from the mouth's corner to the ear.
    line = -0.058 + 0.60 * np.maximum(0.0, x - 0.030)
    beard *= smooth((line - y) / 0.012)
    return {"scalp": hair * (p[:, 1] > head[1] - 0.06), "beard": beard * (jaw[1] < eye[1])}


def _clothes(p: F64, joints: dict[str, F64], arm: F64) -> dict[str, F64]:
    """A T-shirt and shorts, as colours of the skin."""
    neck, hips = joints["neck"], joints["hips"]
    shoulder, elbow = joints["left_upper_arm"], joints["left_lower_arm"]
    q = p * np.where(p[:, :1] < 0.0, (-1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    along = (q - shoulder) @ (elbow - shoulder) / np.square(elbow - shoulder).sum()
    sleeve = np.where(arm > 0.5, smooth((0.52 - along) / 0.012), 1.0)
    r = np.hypot(p[:, 0] / 1.05, p[:, 2] - neck[2])
    collar = neck[1] - _CREW - 0.30 * np.maximum(0.0, p[:, 2] - neck[2]) + 0.10 * np.maximum(0.0, r - 0.05)
    under = smooth((collar - p[:, 1]) / 0.006) * (np.abs(p[:, 0]) < 0.6)
    waist = hips[1] + 0.075
    knee = joints["left_lower_leg"][1]
    hem = knee + 0.42 * (hips[1] - knee)
    above = smooth((p[:, 1] - waist) / 0.004)
    hand = along > 0.6
    top = np.where(hand & (arm > 0.5), 0.0, under * sleeve * np.where(arm > 0.5, 1.0, above))
    shorts = np.where(arm > 0.3, 0.0, (1.0 - above) * smooth((p[:, 1] - hem) / 0.006))
    edges = np.abs(p[:, 1] - hem) < 0.012
    return {"top": top, "shorts": shorts, "seam": np.where(edges, shorts, 0.0) + top * (np.abs(collar - 0.006 - p[:, 1]) < 0.008)}

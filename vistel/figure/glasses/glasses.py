"""Glasses as a part that a person has on: on every level of detail, fixed to the head."""

import numpy as np

from vistel.arrays import F64, U8
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.patch import Patch
from vistel.figure.glasses.frame import Fineness, Frame, Style
from vistel.figure.glasses.head import Head
from vistel.figure.glasses.tubes import Shape
from vistel.figure.part import Part, together
from vistel.figure.skeleton import JOINT_INDEX

GLASSES: dict[str, Style | None] = {
    "none": None,
    "round": Style(2.2, 0.92, 0.0030, 0.00085, 0.0011, 0.0014),
    "rectangular": Style(3.6, 0.66, 0.0035, 0.0016, 0.0018, 0.0027),
    "half_rim": Style(3.0, 0.62, 0.0035, 0.0010, 0.0014, 0.0018, below=False),
}
"""By name."""
_COLOURS = {"round": (128, 102, 66), "rectangular": (38, 28, 24), "half_rim": (52, 54, 58)}
"""sRGB."""
_METAL = ("round", "half_rim")
_FINENESS = Fineness(20, 2, 5, 2), Fineness(12, 1, 3, 1), Fineness(7, 1, 2, 0)
"""By level of detail."""
_CLEAR = 0.05
"""Share of light that a lens holds back."""
_TEXELS = 32
_FRAME = (0.0, 0.0, 0.5, 1.0)
"""Lowest u and v, highest u and v of it in the picture."""
_LENS = (0.5, 0.0, 1.0, 1.0)
"""The same of both lenses."""


def glasses(body: Avatar, kind: str) -> Part | None:
    """Glasses for a naked, bald body of the body model in the T-pose; None for none. kind: one of `GLASSES`. Raises ValueError, one
    line, for a word that is not known."""
    if kind not in GLASSES:
        raise ValueError(f"glasses: expected one of {', '.join(GLASSES)}, got {kind!r}")
    style = GLASSES[kind]
    if style is None:
        return None
    head = Head.of(body)
    frame, limb = Frame.fitted(head, style), body.body.names.index("skull")
    levels = tuple(_level(frame, head.middle, limb, fineness) for fineness in _FINENESS[: 1 + len(body.coarser)])
    metal = float(kind in _METAL)
    bars = Patch(_FRAME, 0.35 - 0.05 * metal, 0.8 * metal, rigid=True)
    opacity = np.full((4, 4), round(255.0 * _CLEAR), np.uint8)
    lens = Patch(_LENS, 0.05, opacity=opacity, blend=True, both_sides=True, rigid=True)
    return Part(f"{kind} glasses", levels, _painted(kind), (bars, lens))


def _level(frame: Frame, middle: F64, limb: int, fineness: Fineness) -> Mesh:
    parts = [_mesh(frame.shape(fineness), middle, limb, _FRAME)]
    if fineness.lens:
        parts.append(_mesh(frame.lenses(fineness), middle, limb, _LENS))
    return together(parts)


def _mesh(shape: Shape, middle: F64, limb: int, box: tuple[float, float, float, float]) -> Mesh:
    p, tri = shape
    count = len(p)
    # By their places: both sides alike, and nothing outside the box.
    along = np.abs(p[:, 0]) - p[:, 2]
    flat = np.column_stack([(along - along.min()) / np.ptp(along), (p[:, 1] - p[:, 1].min()) / np.ptp(p[:, 1])])
    uv = np.array(box[:2]) + (0.1 + 0.8 * flat) * (np.array(box[2:]) - box[:2])
    bone, weight = np.zeros((count, 4), np.int32), np.zeros((count, 4), np.float32)
    bone[:, 0], weight[:, 0] = JOINT_INDEX["head"], 1.0
    number = np.arange(count, dtype=np.int32)
    at = (p + middle).astype(np.float32)
    return Mesh(at, tri, number, uv.astype(np.float32), tri, np.full(count, limb, np.int32), bone, weight)


def _painted(kind: str) -> U8:
    """(H, W, 3) the frame's half, and the lenses'."""
    out = np.zeros((_TEXELS, 2 * _TEXELS, 3), np.uint8)
    out[:, :_TEXELS], out[:, _TEXELS:] = _COLOURS[kind], (96, 102, 106)
    return out

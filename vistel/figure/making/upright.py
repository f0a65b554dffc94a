"""Unit, axes and heading of a person's mesh, found from its proportions; everything found is reported in notes."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.making.source import MakingError

UNITS = (
    ("metres", 1.0, 0.5, 2.6),
    ("feet", 0.3048, 4.0, 7.5),
    ("decimetres", 0.1, 7.5, 26.0),
    ("inches", 0.0254, 50.0, 90.0),
    ("centimetres", 0.01, 90.0, 260.0),
    ("millimetres", 0.001, 500.0, 2600.0),
)
"""Units: name, metres, and the heights of people in it by which it is recognised."""


@dataclass(frozen=True)
class Upright:
    """A similarity from the file's frame to the model frame: p = (q @ rotation.T) * scale + shift."""

    rotation: F64
    scale: float
    shift: F64
    notes: tuple[str, ...]

    def __call__(self, points: F64) -> F64:
        """(N, 3) points of the file in the model frame [m]."""
        return points @ self.rotation.T * self.scale + self.shift

    def turned(self, offsets: F64) -> F64:
        """(V, 3) differences of places."""
        return offsets @ self.rotation.T * self.scale


def upright(
    points: F64,
    *,
    unit: float | None = None,
    up: str | None = None,
    height: float | None = None,
    left: F64 | None = None,
    head: F64 | None = None,
    stated: tuple[float | None, str | None] = (None, None),
) -> Upright:
    """How the mesh with these points (V, 3) gets upright, in metres, soles on the floor, facing +Z.

    unit: metres per unit and up: "Y" or "Z", where they are known; height: of the person [m], where known; left, head: (3,)
    from the right to the left shoulder and from the feet to the head in the file's frame, where a rig tells; stated: unit
    and up as the file has them, which is believed where a person comes of it. Raises MakingError.
    """
    size = np.ptp(points, axis=0)
    notes: list[str] = []
    if up is None:
        up, note = _up_stated(size, head, stated[1])
        notes.append(note)
    rotation = np.eye(3) if up == "Y" else np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    p = points @ rotation.T
    if left is not None:
        side = rotation @ left
        turn = float(np.arctan2(side[2], side[0]))
        if abs(turn) > np.pi / 4:
            quarter = round(turn / (np.pi / 2)) * (np.pi / 2)
            rotation = _about_y(quarter) @ rotation
            notes.append(f"turned by {np.degrees(quarter):.0f} degrees to face +Z (by the rig)")
    else:
        if size_of(p)[0] < 0.75 * size_of(p)[2]:
            rotation = _about_y(np.pi / 2) @ rotation
            notes.append("turned a quarter, arms along X")
        if _faces_back(points @ rotation.T):
            rotation = _about_y(np.pi) @ rotation
            notes.append("turned to face +Z (by the feet)")
    p = points @ rotation.T
    tall = float(np.ptp(p[:, 1]))
    if height is not None:
        scale = height / max(tall, 1e-12)
        notes.append(f"scaled to the height given, {height:.2f} m")
    elif unit is None and stated[0] is not None and 0.5 <= tall * stated[0] <= 2.6:
        scale = stated[0]
        notes.append(f"unit of the file, {stated[0]:g} m: {tall * scale:.2f} m tall")
    elif unit is not None:
        scale = unit
        if not 0.5 <= tall * scale <= 2.6:
            raise MakingError(f"its unit makes a person {tall * scale:.3g} m tall, expected 0.5 to 2.6; give --height METRES")
    else:
        scale, note = _unit(tall)
        if stated[0] is not None:
            note = f"its unit of {stated[0]:g} m would make a person {tall * stated[0]:.3g} m tall; {note}"
        notes.append(note)
    p = p * scale
    middle = 0.5 * (p[:, 0].min() + p[:, 0].max())
    foot = p[p[:, 1] < p[:, 1].min() + 0.07 * np.ptp(p[:, 1])]
    shift = np.array((-middle, -p[:, 1].min(), -_ankle_z(foot)))
    return Upright(rotation, scale, shift, tuple(notes))


def size_of(p: F64) -> F64:
    """(3,) extents."""
    return np.ptp(p, axis=0)


def _up_stated(size: F64, head: F64 | None, stated: str | None) -> tuple[str, str]:
    """By the rig where there is one, else as the file says it unless its shape lies, else by the shape."""
    if head is not None and float(np.abs(head[1:]).max()) > 0.5 * float(size.max()):
        up = "Y" if abs(head[1]) > abs(head[2]) else "Z"
        return up, f"{up} is up (by the rig)" + (f", though the file says {stated}" if stated not in (None, up) else "")
    try:
        up, note = _up(size)
    except MakingError:
        if stated in ("Y", "Z"):
            return stated, f"{stated} is up, as the file says"
        raise
    return up, note + (f", though the file says {stated}" if stated not in (None, up) else "")


def _up(size: F64) -> tuple[str, str]:
    depth = int(np.argmin(size[1:])) + 1
    if size[depth] > 0.6 * size.max():
        raise MakingError("not a standing person (about as deep as tall); pose it standing, arms sideways, or give --up Y or Z")
    return ("Y", "Y is up") if depth == 2 else ("Z", "Z is up, turned to Y up")


def _unit(tall: float) -> tuple[float, str]:
    for name, scale, low, high in UNITS:
        if low <= tall <= high:
            return scale, f"{tall:.4g} units tall: taken as {name}, {tall * scale:.3f} m"
    raise MakingError(f"the mesh is {tall:.4g} units tall, which is nobody's height in any unit; give --height METRES")


def _about_y(angle: float) -> F64:
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _ankle_z(foot: F64) -> float:
    """Heels are behind the ankles by about a quarter of the foot."""
    return float(foot[:, 2].min() + 0.27 * np.ptp(foot[:, 2]))


def _faces_back(p: F64) -> bool:
    """Whether toes point to -Z: ankles are nearer to heels than to toes."""
    low, tall = p[:, 1].min(), np.ptp(p[:, 1])
    sole = p[p[:, 1] < low + 0.03 * tall]
    ankle = p[(p[:, 1] > low + 0.05 * tall) & (p[:, 1] < low + 0.09 * tall)]
    if len(sole) < 8 or len(ankle) < 8:
        return False
    middle = 0.5 * (ankle[:, 2].min() + ankle[:, 2].max())
    return bool(sole[:, 2].max() - middle < middle - sole[:, 2].min())

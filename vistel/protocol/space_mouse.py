"""3Dconnexion's 3D mice on USB: their HID reports.

A report begins with its number. 1: translation of the cap, three signed 16-bit numbers, little-endian; 2: rotation, the same;
newer mice put all six into report 1. 3: a bit for each button. The axes are right, towards the user and down; counts reach
about 350 either way. Reports come while the cap is touched, and once with zeros when it is released.

Sources: linux/drivers/hid and the spacenavd project's descriptions of these devices.
"""

import struct
from dataclasses import dataclass, replace

LOGITECH = 0x046D
"""USB vendor of the devices made until 2013."""
THREE_DCONNEXION = 0x256F
"""USB vendor of the devices made since."""
_LOGITECH_PRODUCTS = frozenset((0xC621, 0xC623, 0xC625, 0xC626, 0xC627, 0xC628, 0xC629, 0xC62B))
_MICE = range(0xC62E, 0xC660)
FULL = 350
"""Counts at full deflection of the cap."""


def is_space_mouse(vendor_id: int, product_id: int) -> bool:
    """Whether a device of these ids is one."""
    return product_id in (_LOGITECH_PRODUCTS if vendor_id == LOGITECH else _MICE)


@dataclass(frozen=True)
class SpaceMouseState:
    """push: to the right, towards the user, down; turn: about these axes, right-handed; counts. buttons: a bit each."""

    push: tuple[int, int, int] = (0, 0, 0)
    turn: tuple[int, int, int] = (0, 0, 0)
    buttons: int = 0


def after(state: SpaceMouseState, report: bytes) -> SpaceMouseState:
    """The state after a report; the same after an unknown one."""
    if len(report) >= 7 and report[0] in (1, 2):
        axes = _axes(report[1:7])
        if report[0] == 2:
            return replace(state, turn=axes)
        # Only newer mice send reports of this length.
        return replace(state, push=axes, turn=_axes(report[7:13])) if len(report) >= 13 else replace(state, push=axes)
    if len(report) >= 2 and report[0] == 3:
        return replace(state, buttons=int.from_bytes(report[1:5], "little"))
    return state


def _axes(data: bytes) -> tuple[int, int, int]:
    x, y, z = (max(-FULL, min(FULL, n)) for n in struct.unpack("<3h", data))
    return x, y, z

"""A 3D mouse as it behaves on its wire: HID reports of how its cap is pushed and turned."""

import struct


class SpaceMouseReports:
    """newer: all six axes in one report, else two in turn. push, turn: of the cap, -1 to 1, along and about the device's axes
    (right, towards the user, down)."""

    period_s = 0.016

    def __init__(self, newer: bool = False) -> None:
        self._newer = newer
        self.push = self.turn = (0.0, 0.0, 0.0)
        self.buttons = 0
        self._waiting: list[bytes] = []
        self._told = (self.push, self.turn, self.buttons)

    def next(self) -> bytes:
        """The next report; none while nobody touches it."""
        if not self._waiting:
            now = self.push, self.turn, self.buttons
            if now == self._told and not any((*self.push, *self.turn)):
                return b""
            if self.buttons != self._told[2]:
                self._waiting.append(b"\3" + self.buttons.to_bytes(2, "little"))
            push, turn = (struct.pack("<3h", *(round(350 * a) for a in axes)) for axes in now[:2])
            self._waiting += [b"\1" + push + turn] if self._newer else [b"\1" + push, b"\2" + turn]
            self._told = now
        return self._waiting.pop(0)

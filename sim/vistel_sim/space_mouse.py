"""A simulated 3D mouse: HID reports of the translation and rotation of its cap."""

import struct


class SpaceMouseReports:
    """newer: all six axes in one report, else two reports. push, turn: of the cap, -1 to 1, along and about the device's axes
    (right, towards the user, down)."""

    period_s = 0.016

    def __init__(self, newer: bool = False) -> None:
        self._newer = newer
        self.push = self.turn = (0.0, 0.0, 0.0)
        self.buttons = 0
        self._queued: list[bytes] = []
        self._last_sent = (self.push, self.turn, self.buttons)

    def next(self) -> bytes:
        """The next report; empty while nothing changes."""
        if not self._queued:
            now = self.push, self.turn, self.buttons
            if now == self._last_sent and not any((*self.push, *self.turn)):
                return b""
            if self.buttons != self._last_sent[2]:
                self._queued.append(b"\3" + self.buttons.to_bytes(2, "little"))
            push, turn = (struct.pack("<3h", *(round(350 * a) for a in axes)) for axes in now[:2])
            self._queued += [b"\1" + push + turn] if self._newer else [b"\1" + push, b"\2" + turn]
            self._last_sent = now
        return self._queued.pop(0)

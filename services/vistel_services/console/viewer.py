"""What one viewer still gets: of each kind of message the newest, so that who is slow costs nobody anything."""

from __future__ import annotations

import asyncio

FRAME = "frame"
"""The kind that gives way to all others."""


class Viewer:
    """Lives on the event loop. Whatever a viewer does, one message of each kind waits for it, no more."""

    def __init__(self) -> None:
        self.left_out = 0
        """Frames that a newer one has replaced before they were sent."""
        self._waiting: dict[str, str | bytes] = {}
        self._something = asyncio.Event()

    def put(self, kind: str, message: str | bytes) -> None:
        """The newest of its kind. Each stands for itself: nothing that is left out is missed later."""
        self.left_out += kind == FRAME and FRAME in self._waiting
        self._waiting[kind] = message
        self._something.set()

    async def next(self) -> str | bytes:
        """What is sent next: words before frames."""
        while not self._waiting:
            self._something.clear()
            await self._something.wait()
        kind = next((k for k in self._waiting if k != FRAME), FRAME)
        return self._waiting.pop(kind)

"""What one viewer still gets: of each kind of message the newest, so that who is slow costs nobody anything."""

from __future__ import annotations

import asyncio
from collections import deque

from vistel.audio.forwarded_voices import FORMAT
from vistel.session.screens import ForwardedPicture, WaitingPictures

_MOST_RECORDS = 150
"""Of voices: what waits longer is too late to be heard."""
FRAME = "frame"
_LARGE = ("frame", "skin", "dents")
"""How kinds begin that give way to all others, and take turns."""


class Viewer:
    """Lives on the event loop. Whatever a viewer does, one message of each kind waits for it, no more, and few packets of voices.
    own: whose voice is not sent there; steers: whether it is the host's; hears: whether voices are sent."""

    def __init__(self, own: str = "", *, steers: bool = False) -> None:
        self.own, self.steers, self.hears = own, steers, False
        self.left_out = 0
        """Frames that a newer one has replaced before they were sent."""
        self._waiting: dict[str, str | bytes] = {}
        self._voices: deque[bytes] = deque(maxlen=_MOST_RECORDS)
        self._screens = WaitingPictures()
        self._something = asyncio.Event()

    def put(self, kind: str, message: str | bytes) -> None:
        """The newest of its kind. Each stands for itself: nothing that is left out is missed later."""
        self.left_out += kind == FRAME and FRAME in self._waiting
        self._waiting[kind] = message
        self._something.set()

    def put_voices(self, records: list[tuple[str, bytes]]) -> None:
        """Packets of voices, each with whose it is."""
        if self.hears and (heard := [record for name, record in records if name != self.own]):
            self._voices.extend(heard)
            self._something.set()

    def put_screens(self, pictures: list[ForwardedPicture]) -> None:
        """Pictures of what participants show live."""
        if self._screens.put(pictures):
            self._something.set()

    async def next(self) -> str | bytes:
        """What is sent next: words, then voices, then what is shown live, then frames and what gives way."""
        while not (self._waiting or self._voices or self._screens):
            self._something.clear()
            await self._something.wait()
        kind = next((k for k in self._waiting if not k.startswith(_LARGE)), None)
        if kind is None and self._voices:
            voices = bytes((FORMAT,)) + b"".join(self._voices)
            self._voices.clear()
            return voices
        if kind is None and self._screens:
            return self._screens.next()
        return self._waiting.pop(kind or next(iter(self._waiting)))

"""Waits for a phone with Live Link Face."""

from __future__ import annotations

from vistel.capture.live_link_frames import LiveLinkDecoder
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import Link, NoAnswerError
from vistel_services.devices.probe import hear

_HEARD_S = 2.0


class LiveLinkDriver:
    """A phone only talks; there is nothing to start."""

    topic = BY_NAME["face"]
    stop = b""
    beat = None

    def __init__(self, name: str, port: int) -> None:
        self.name = name
        self.decoder = LiveLinkDecoder(name)
        self._port = port

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        if not await hear(link, self.decoder, "Live Link Face", _HEARD_S):
            raise NoAnswerError(f"no phone with a face in its picture sends to UDP port {self._port}")
        return f"Live Link Face on {self.decoder.subject or 'a phone'}"

"""Waits for a VR tracking suite that sends VMC."""

from __future__ import annotations

from vistel.capture.vmc_frames import VmcDecoder
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import Link, NoAnswerError
from vistel_services.devices.probe import hear

_HEARD_S = 2.0


class VmcDriver:
    """A suite only talks; there is nothing to start."""

    topic = BY_NAME["tracker"]
    stop = b""
    beat = None

    def __init__(self, name: str, port: str, height_m: float) -> None:
        self.name = name
        self.decoder = VmcDecoder(name, height_m)
        self._port = port

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        if not await hear(link, self.decoder, "a VMC tracking suite", _HEARD_S):
            raise NoAnswerError(f"no tracking suite sends VMC to UDP port {self._port}")
        return "a tracked body over VMC"

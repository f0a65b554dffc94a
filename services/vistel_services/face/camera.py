"""Waits until something is seen in a camera's pictures."""

from vistel.vision.camera_frames import CameraDecoder, PictureReader
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import Link, NoAnswerError

_SEEN_S = 1.0


class CameraDriver:
    """A camera only shows; there is nothing to start."""

    topic = BY_NAME["face"]
    stop = b""
    beat = None

    def __init__(self, name: str, reader: PictureReader, what: str) -> None:
        """reader: what reads the pictures. what: the camera in words."""
        self.name = name
        self.decoder = CameraDecoder(name, reader)
        self._what = what

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        seen, shown = link.frames, self.decoder.pictures
        if await link.wait_for(lambda: link.frames if link.frames > seen else None, _SEEN_S) is None:
            raise NoAnswerError(self.decoder.trouble or "nothing is seen" if self.decoder.pictures > shown else "no pictures come")
        return self._what

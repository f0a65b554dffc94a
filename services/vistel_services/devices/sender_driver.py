"""Waits for packets of a sender that cannot be asked and needs no start: a phone, a tracking suite."""

from collections.abc import Callable

from vistel.devices.identify import identify_sender
from vistel.wire.topics import Topic
from vistel_services.devices.device import Decoder, DeviceError, Link, NoAnswerError

_HEARD_S = 2.0
"""A sender that runs must be heard within this time [s]."""


class SenderDriver:
    """See the module."""

    stop = b""
    beat = None

    def __init__(self, name: str, topic: Topic, decoder: Decoder, sender: str, missing: str, about: Callable[[], str]) -> None:
        """sender: in words. missing: what is said when nothing arrives. about: a line about a sender that was heard."""
        self.name, self.topic, self.decoder = name, topic, decoder
        self._sender, self._missing, self._about = sender, missing, about

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        seen, skipped = link.frames, self.decoder.bytes_skipped
        link.recent.clear()
        if await link.wait_for(lambda: link.frames if link.frames > seen else None, _HEARD_S) is not None:
            return self._about()
        if self.decoder.bytes_skipped == skipped:
            raise NoAnswerError(self._missing)
        other = identify_sender(bytes(link.recent))
        if other not in (None, self._sender):
            raise DeviceError(f"{other} sends to this port; {self._sender} was expected")
        raise NoAnswerError(f"what arrives is not from {self._sender}; is another program sending to this port?")

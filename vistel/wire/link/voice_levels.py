"""How loud a voice is, told now and then: to those in a crowd who do not receive it."""

from __future__ import annotations

from vistel.v1.audio_pb2 import Voice
from vistel.wire.bus import Publication

_EVERY_NS = 240_000_000


class VoiceLevels:
    """Of one voice."""

    def __init__(self, publication: Publication | None) -> None:
        """publication: None: nobody is told."""
        self._publication, self._told_ns = publication, 0

    def tell(self, message: Voice) -> None:
        """A message of the voice has been sent."""
        t_ns = message.header.t_ns
        if self._publication is None or not message.opus or 0 <= t_ns - self._told_ns < _EVERY_NS:
            return
        self._told_ns = t_ns
        level = Voice(level_db=message.level_db, talking=message.talking)
        level.header.t_ns = t_ns
        self._publication.put(level)

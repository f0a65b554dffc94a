"""What parsers of byte streams have in common: bytes come in any pieces, and what cannot be anything is stepped over."""

import re
from abc import ABC, abstractmethod

from vistel.protocol.arrival import ByteArrivals

WAIT = -1
"""What begins here can still become something: more bytes are needed."""
NO = 0
"""Nothing begins here."""


class StreamParser(ABC):
    """Keeps what is not yet whole; counts what it skips.

    start: matches at every byte at which something can begin, at the buffer's end too, where it is not yet whole.
    """

    start: re.Pattern[bytes]

    def __init__(self, baud: int) -> None:
        self.bytes_skipped = 0
        self._buffer = bytearray()
        self._arrivals = ByteArrivals(baud)
        self._base = 0

    def _read(self, data: bytes, t_ns: int) -> None:
        """Go through `data`, which was read at `t_ns`, and through what was left of the bytes before."""
        if not data:
            return
        buffer = self._buffer
        buffer += data
        self._arrivals.read(len(data), t_ns)
        self._base = self._arrivals.end - len(buffer)
        search = self.start.search
        i, size = 0, len(buffer)
        while i < size:
            found = search(buffer, i)
            at = size if found is None else found.start()
            self.bytes_skipped += at - i
            i = at
            if i == size:
                break
            taken = self._take(i)
            if taken == WAIT:
                break
            if taken == NO:
                self.bytes_skipped += 1
                taken = 1
            i += taken
        del buffer[:i]
        self._arrivals.forget(self._base + i)

    def _began_ns(self, i: int) -> int:
        """When the byte at `i` of the buffer began to be sent."""
        return self._arrivals.began_ns(self._base + i)

    @abstractmethod
    def _take(self, i: int) -> int:
        """How many bytes what begins at `i` of the buffer takes, or NO, or WAIT."""

"""What parsers of byte streams have in common: bytes arrive in any pieces; invalid ones are skipped and counted."""

import re
from abc import ABC, abstractmethod

from vistel.protocol.arrival import ByteArrivals

INCOMPLETE = -1
"""More bytes are needed to decide what begins at an index."""
NO_MATCH = 0
"""Nothing valid begins at an index."""


class StreamParser(ABC):
    """Keeps incomplete bytes; counts skipped ones.

    start: matches wherever a record can begin, also if it is incomplete at the end of the buffer.
    """

    start: re.Pattern[bytes]

    def __init__(self, baud: int) -> None:
        self.bytes_skipped = 0
        self._buffer = bytearray()
        self._arrivals = ByteArrivals(baud)
        self._base = 0

    def _read(self, data: bytes, t_ns: int) -> None:
        """Parse `data`, which was read at `t_ns`, after the bytes kept from earlier reads."""
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
            if taken == INCOMPLETE:
                break
            if taken == NO_MATCH:
                self.bytes_skipped += 1
                taken = 1
            i += taken
        del buffer[:i]
        self._arrivals.forget(self._base + i)

    def _began_ns(self, i: int) -> int:
        """When the byte at `i` of the buffer began to be sent [ns]."""
        return self._arrivals.began_ns(self._base + i)

    @abstractmethod
    def _take(self, i: int) -> int:
        """Parse at `i` of the buffer; returns the number of bytes used, NO_MATCH or INCOMPLETE."""

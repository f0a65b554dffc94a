"""When a byte crossed the wire, from when it was read."""

from collections import deque


class ByteArrivals:
    """Keeps, for the bytes still held by a parser, the time at which each was sent.

    A read gives many bytes at once and only its own time. The last of them had just arrived; every byte before it
    was one byte time earlier, but never earlier than the read before.
    """

    def __init__(self, baud: int) -> None:
        self._byte_ns = 10_000_000_000 / baud  # start bit, 8 data bits, stop bit
        self._reads: deque[tuple[int, int, int]] = deque()  # offset after the read, its time, time of the read before
        self._end = 0
        self._last_ns = 0

    @property
    def end(self) -> int:
        """Offset in the stream of the byte to come."""
        return self._end

    def read(self, count: int, t_ns: int) -> None:
        """`count` bytes were read at `t_ns`."""
        self._end += count
        self._reads.append((self._end, t_ns, self._last_ns))
        self._last_ns = t_ns

    def began_ns(self, offset: int) -> int:
        """When the byte at `offset` of the stream began to be sent; offsets asked for must not decrease."""
        while self._reads and self._reads[0][0] <= offset:
            self._reads.popleft()
        end, t_ns, before_ns = self._reads[0]
        return max(int(t_ns - (end - offset) * self._byte_ns), before_ns)

    def forget(self, offset: int) -> None:
        """Bytes before `offset` are no longer of interest."""
        while self._reads and self._reads[0][0] <= offset:
            self._reads.popleft()

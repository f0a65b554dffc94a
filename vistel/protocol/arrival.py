"""Times at which bytes were sent, from the times at which they were read."""

from collections import deque


class ByteArrivals:
    """The sending times of the bytes that a parser still has in its buffer.

    A read gives many bytes and one time. The last byte had just arrived; each byte before it was sent one byte time earlier,
    but not before the last read.
    """

    def __init__(self, baud: int) -> None:
        self._byte_ns = 10_000_000_000 / baud  # start bit, 8 data bits, stop bit
        self._reads: deque[tuple[int, int, int]] = deque()  # offset after the read, its time, time of the read before
        self._end = 0
        self._last_ns = 0

    @property
    def end(self) -> int:
        """Offset in the stream of the next byte."""
        return self._end

    def read(self, count: int, t_ns: int) -> None:
        """`count` bytes were read at `t_ns`."""
        self._end += count
        self._reads.append((self._end, t_ns, self._last_ns))
        self._last_ns = t_ns

    def began_ns(self, offset: int) -> int:
        """When the byte at `offset` began to be sent [ns]; offsets must not decrease from call to call."""
        while self._reads and self._reads[0][0] <= offset:
            self._reads.popleft()
        end, t_ns, before_ns = self._reads[0]
        return max(int(t_ns - (end - offset) * self._byte_ns), before_ns)

    def forget(self, offset: int) -> None:
        """Drop the times of bytes before `offset`."""
        while self._reads and self._reads[0][0] <= offset:
            self._reads.popleft()

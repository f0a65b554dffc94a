"""What every simulated port has: the time that bytes take on a line, and answers that wait for it."""

import asyncio
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from pathlib import Path

from vistel.wire import background
from vistel.wire.clock import Clock

GARBLED = bytes((37 * b + 11) & 0xFF for b in range(256))
"""Bytes as read at a wrong speed: none as sent."""


class SimulatedPort(ABC):
    """The device's end of a line.

    received: called with the bytes a client wrote. A simulated line has no speed, so the time of each byte (start bit, 8 data
    bits, stop bit at `baud`) is kept here: `reserve` reserves the line, `put` sends bytes. strict: with another speed set,
    the client's bytes are ignored and it receives garbage. Both may change.
    """

    def __init__(
        self, path: Path, clock: Clock, received: Callable[[bytes], None], baud: int = 115200, *, strict: bool = False
    ) -> None:
        self.path = path
        self.baud = baud
        self.strict = strict
        self.tap: Callable[[str, bytes], None] = lambda way, data: None
        """Called with "<" and what came from the client, with ">" and what goes to it."""
        self._clock = clock
        self._received = received
        self._free_ns = 0
        self._answers: set[asyncio.Task[None]] = set()
        self._waiting: deque[bytes] = deque()
        self._background = background.current()

    @property
    @abstractmethod
    def plugged(self) -> bool: ...

    @abstractmethod
    def plug(self) -> None:
        """Make the port appear."""

    @abstractmethod
    def unplug(self) -> None:
        """Make the port vanish; a client that has it open sees the line hang up."""

    @abstractmethod
    def put(self, data: bytes) -> None:
        """Deliver bytes at the end of their time on the line. All or none: a port without reader loses whole records."""

    def reserve(self, count: int, ready_ns: int) -> int:
        """Reserve the line for `count` bytes that are ready at `ready_ns`; returns when the last is sent [ns]."""
        self._free_ns = max(self._free_ns, ready_ns) + count * 10_000_000_000 // self.baud
        return self._free_ns

    def answer(self, data: bytes, delay_s: float = 0.0) -> None:
        """Send a reply after what is on the line; one with a delay does not reserve the line."""
        now_ns = self._clock.now_ns()
        if delay_s:
            waiting, due_ns = deque((data,)), now_ns + round(delay_s * 1e9)
        else:
            waiting, due_ns = self._waiting, self.reserve(len(data), now_ns)
            waiting.append(data)
        task = self._background.start(self._later(waiting, due_ns), "answer")
        self._answers.add(task)
        task.add_done_callback(self._answers.discard)

    def discard_answers(self) -> None:
        for task in self._answers:
            task.cancel()
        self._waiting = deque()

    async def _later(self, waiting: deque[bytes], due_ns: int) -> None:
        """Send the first of what waits: on a busy machine the answer after it may be woken first, and must not overtake it."""
        await self._clock.sleep_until_ns(due_ns)
        self.put(waiting.popleft())

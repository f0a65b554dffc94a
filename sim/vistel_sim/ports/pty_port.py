"""A serial port whose other end is a simulated device: a pseudo-terminal, paced like a wire, that can be unplugged."""

import asyncio
import contextlib
import fcntl
import os
import struct
import termios
import tty
from collections.abc import Callable
from pathlib import Path

from vistel.wire.clock import Clock
from vistel_sim.ports.port import GARBLED, SimulatedPort

_LIMIT = 2048
"""Bytes that may wait for a reader; further records are lost."""
_LOOK_EVERY = 256
"""After so many bytes the number of waiting ones is checked."""


class PtyPort(SimulatedPort):
    """Serves the master side of a pty on the event loop; clients open the link at `path`."""

    def __init__(
        self, path: Path, clock: Clock, received: Callable[[bytes], None], baud: int = 115200, *, strict: bool = False
    ) -> None:
        super().__init__(path, clock, received, baud, strict=strict)
        self.dropped = 0
        self._master = self._slave = -1
        self._rest = b""
        self._waits_for_room = False
        self._unseen = 0

    @property
    def plugged(self) -> bool:
        return self._master >= 0

    def plug(self) -> None:
        """Make the port appear at its path."""
        if self.plugged:
            return
        self._master, self._slave = os.openpty()
        # The slave stays open here: without it the master reports an error each time a client closes.
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._rest, self._unseen, self._free_ns = b"", 0, 0
        asyncio.get_running_loop().add_reader(self._master, self._readable)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        link = self.path.with_name(f".{self.path.name}.new")
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(self._slave))
        link.replace(self.path)  # atomic: no link to an older port is seen

    def unplug(self) -> None:
        """Make the port vanish; a client that has it open sees the line hang up."""
        if not self.plugged:
            return
        self.discard_answers()
        loop = asyncio.get_running_loop()
        loop.remove_reader(self._master)
        loop.remove_writer(self._master)
        self._waits_for_room = False
        self.path.unlink(missing_ok=True)
        os.close(self._master)
        os.close(self._slave)
        self._master = self._slave = -1

    def put(self, data: bytes) -> None:
        """Deliver bytes at the end of their time on the line. All or none: a port without reader loses whole records."""
        if not self.plugged:
            return
        self._unseen -= len(data)
        if self._unseen < 0:
            waiting = struct.unpack("i", fcntl.ioctl(self._slave, termios.FIONREAD, b"\0\0\0\0"))[0]
            if waiting > _LIMIT or len(self._rest) > _LIMIT:
                self._unseen = 0
                self.dropped += 1
                return
            self._unseen = _LOOK_EVERY
        if self.strict and not self._speed_matches():
            data = data.translate(GARBLED)
        self.tap(">", data)
        self._rest += data
        self._hand_over()

    def _hand_over(self) -> None:
        """Write what waits, as much as the kernel takes; the rest later."""
        written = 0
        with contextlib.suppress(BlockingIOError):
            written = os.write(self._master, self._rest)
        self._rest = self._rest[written:]
        if bool(self._rest) != self._waits_for_room:
            self._waits_for_room = bool(self._rest)
            loop = asyncio.get_running_loop()
            if self._rest:
                loop.add_writer(self._master, self._hand_over)
            else:
                loop.remove_writer(self._master)

    def _readable(self) -> None:
        try:
            data = os.read(self._master, 4096)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        self.tap("<", data)
        if data and self._speed_matches():
            self._received(data)

    def _speed_matches(self) -> bool:
        return not self.strict or termios.tcgetattr(self._slave)[5] == getattr(termios, f"B{self.baud}")

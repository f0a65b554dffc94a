"""A line to a device's side of a protocol, and what a check says and reads on it."""

import re
from abc import ABC, abstractmethod
from typing import Protocol
from unittest import SkipTest

from vistel.wire.clock import SystemClock

ANSWER_S = 2.0
"""A device answers a command within this time [s]."""
QUIET_S = 0.25
"""A line on which nothing came for this time is quiet [s]."""
QUIET_WITHIN_S = 3.0
"""A device that has been told to be silent is so after this time [s]."""
_MOST = 1 << 20
"""More than a check ever reads [bytes]."""
_SHOWN = 60
"""Bytes of what came that a result shows."""
_CLOCK = SystemClock()


class LineError(Exception):
    """A line that cannot be opened, or is gone; one line for a person."""


class NonconformityError(AssertionError):
    """What a device did instead of what its protocol says; one line."""


class NotApplicable(SkipTest):
    """Why a check cannot be made with this device, one line; pytest takes it for a skipped test."""


class Line(ABC):
    """An open line. Another implementation than a port, such as a class in the same process, derives from this."""

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send to the device. Raises LineError when it is gone."""

    @abstractmethod
    def read(self, within_s: float) -> bytes:
        """What has come: at least one byte as soon as there is one, nothing after `within_s` [s]. Raises LineError when the device
        is gone."""

    def set_baud(self, baud: int) -> None:
        """Change the line's speed, where it has one."""
        del baud

    def close(self) -> None:
        """Let go of the device."""
        return

    def now_s(self) -> float:
        """Time on this line [s]; one whose device is simulated in its own time has that."""
        return _CLOCK.steady_ns() * 1e-9


class Talk:
    """Commands and answers on a line. What was read and not yet taken is kept."""

    def __init__(self, line: Line, patience: float = 1.0) -> None:
        """patience: how many times longer than usual answers may take."""
        self.line = line
        self._patience = patience
        self._rest = b""

    def send(self, data: bytes) -> None:
        """Send `data`."""
        self.line.write(data)

    def expect(self, pattern: bytes, what: str, within_s: float = ANSWER_S) -> re.Match[bytes]:
        """The next bytes, which must match `pattern`. Raises NonconformityError when they do not within `within_s` [s]."""
        return self._until(re.compile(pattern, re.DOTALL).match, what, within_s)

    def find(self, pattern: bytes, what: str, within_s: float = ANSWER_S, *, patient: bool = True) -> re.Match[bytes]:
        """The next match of `pattern`; what comes before it is dropped. Raises NonconformityError as `expect` does.

        patient: whether patience makes `within_s` longer."""
        return self._until(re.compile(pattern, re.DOTALL).search, what, within_s if patient else within_s / self._patience)

    def ask(self, command: bytes, pattern: bytes, within_s: float = ANSWER_S) -> re.Match[bytes]:
        """Send `command`; the answer, which must match `pattern`."""
        self.send(command)
        return self.expect(pattern, f"answer to {shown(command)}", within_s)

    def exactly(self, count: int, what: str, within_s: float = ANSWER_S) -> bytes:
        """The next `count` bytes. Raises NonconformityError when fewer come."""
        return self.expect(b".{%d}" % count, f"{what} of {count} bytes", within_s)[0]

    def quiet(self, for_s: float = QUIET_S, within_s: float = QUIET_WITHIN_S) -> bytes:
        """What comes until nothing has come for `for_s`. Raises NonconformityError when the line is not quiet after `within_s` [s].

        A busy machine may be later than `for_s`: where an answer can be asked for, ask, and take what came before it."""
        came, self._rest = self._rest, b""
        end_s = self.line.now_s() + within_s
        while data := self.line.read(for_s * self._patience):
            came += data
            if self.line.now_s() > end_s or len(came) > _MOST:
                raise NonconformityError(f"expected silence, {len(came)} bytes came: {shown(came[-_SHOWN:])}")
        return came

    def silent(self, for_s: float = QUIET_S) -> None:
        """Raises NonconformityError when anything comes within `for_s`."""
        came = self._rest or self.line.read(for_s)
        if came:
            raise NonconformityError(f"expected silence, got {shown(came)}")

    def more(self, within_s: float = ANSWER_S) -> bool:
        """Whether there is something to take, or it comes within `within_s` [s]."""
        self._rest = self._rest or self.line.read(within_s * self._patience)
        return bool(self._rest)

    def _until(self, matcher: "_Matcher", what: str, within_s: float) -> re.Match[bytes]:
        end_s = self.line.now_s() + within_s * self._patience
        while (found := matcher(self._rest)) is None:
            left_s = end_s - self.line.now_s()
            data = self.line.read(left_s) if left_s > 0.0 and len(self._rest) < _MOST else b""
            if not data:
                raise NonconformityError(f"expected {what}, got {shown(self._rest) if self._rest else 'nothing'}")
            self._rest += data
        self._rest = self._rest[found.end() :]
        return found


class _Matcher(Protocol):
    """What `re.Pattern.match` and `search` are."""

    def __call__(self, data: bytes, /) -> re.Match[bytes] | None: ...


def shown(data: bytes) -> str:
    """Bytes as one line for a person."""
    text = repr(data[:_SHOWN])[1:]
    return text + f" and {len(data) - _SHOWN} more" if len(data) > _SHOWN else text


def require(condition: object, otherwise: str) -> None:
    """Raises NonconformityError, saying `otherwise`, unless `condition` holds."""
    if not condition:
        raise NonconformityError(otherwise)

"""A CyberGlove as an interface unit would behave on its serial line (CyberGlove III guide; later units' drivers)."""

import math
import re
from collections.abc import Callable, Sequence

import numpy as np

from vistel.protocol.cyberglove import MASKS
from vistel.protocol.glove_calibration import GloveCalibration, default_calibration
from vistel_sim.device import Reply

_SWITCHES = b"UDFLJW"
_BINARY_ARGUMENTS = dict.fromkeys(_SWITCHES, 1) | {ord("N"): 1, ord("M"): 3, ord("T"): 4}
_UNKNOWN = b" e?\r\n\x00"


class CyberGlove:
    """One glove with 18 or 22 sensors.

    angles: t [s] -> (20,) radians, order of `Posture.hands`. noise: standard deviation of a sensor [counts].
    restart_s: how long ^R takes (a real unit: 1.75).
    """

    def __init__(
        self,
        angles: Callable[[float], Sequence[float]],
        *,
        sensors: int = 18,
        right: bool = False,
        calibration: GloveCalibration | None = None,
        noise: float = 0.3,
        seed: int = 0,
        restart_s: float = 1.75,
    ) -> None:
        self.sensors = sensors
        self.right = right
        self.plugged = True
        self._saturated = False
        self._drift = 0.0
        self._angles = angles
        self._calibration = calibration or default_calibration()
        self._noise = noise
        self._rng = np.random.default_rng(seed)
        self._restart_s = restart_s
        self._restarting_until_s = -math.inf
        self._now_s = 0.0
        self._reset()

    def _reset(self) -> None:
        self._streaming = False
        self._once = self._as_text = 0
        self._pending = b""
        self._mask = MASKS[self.sensors]
        self._chosen = list(range(self.sensors))
        self._words = (1152, 1)
        self._on = dict.fromkeys(_SWITCHES, False) | {ord("F"): True}

    def disturb(self, drifting_s: float, saturated: bool) -> None:
        """Set drift (two counts a second, for `drifting_s` so far) and saturation."""
        self._drift = 2.0 * drifting_s
        self._saturated = saturated

    @property
    def period_s(self) -> float:
        """Period of the stream, or of looking for a request."""
        if not self._streaming:
            return 0.01
        return max(self._words[0] * self._words[1] / 115200.0, 1.0 / 150.0)

    @property
    def latency_s(self) -> float:
        return 0.0

    def next_length(self) -> int:
        """Bytes of the coming sample, 0 when none is due."""
        if self._as_text:
            return 4 + 4 * len(self._chosen)
        if not (self._streaming or self._once):
            return 0
        return 2 + len(self._chosen) + 5 * self._on[ord("D")] + self._on[ord("U")] + 2 * (not self.plugged)

    def measure(self, t_s: float) -> bytes:
        counts = np.array(self._calibration.counts(list(self._angles(t_s)), self.sensors))
        counts += self._drift + self._noise * self._rng.standard_normal(self.sensors)
        if self._saturated:
            counts[:] = 255.0
        rounded = np.rint(counts).astype(np.int64).tolist()
        values = bytes([min(255, max(1, rounded[i])) for i in self._chosen])
        if self._as_text:
            self._as_text -= 1
            return b"g " + " ".join(map(str, values)).encode() + b"\r\n\0"
        out = (b"S" if self._streaming else b"G") + values
        self._once = max(0, self._once - (not self._streaming))
        if self._on[ord("D")]:
            out += _timestamp(round(t_s * 1000))
        if self._on[ord("U")]:
            out += bytes((0x80 | self.plugged,))
        return out + (b"" if self.plugged else b"eg") + b"\0"

    def receive(self, data: bytes, t_s: float) -> list[Reply]:
        """Take commands at `t_s`; returns the answers."""
        self._now_s = t_s
        if t_s < self._restarting_until_s:
            return []
        data = self._pending + data
        replies: list[Reply] = []
        i = 0
        while i < len(data):
            taken = self._command(data[i:], replies)
            if taken == 0:
                break
            i += taken
        self._pending = data[i:]
        return replies

    def _command(self, data: bytes, replies: list[Reply]) -> int:
        """Execute the first command; returns its length in bytes, 0 if incomplete."""
        c = data[0]
        if data.startswith((b"\x03", b"^c")):
            self._streaming, self._once, self._as_text = False, 0, 0
            replies.append(Reply(b"\x03\x00"))
            return 1 if c == 3 else 2
        if c == 0x12:
            self._reset()
            self._restarting_until_s = self._now_s + self._restart_s
            replies.append(Reply(b"\x12\r\n\x00", self._restart_s))
            return len(data)  # what is sent during the restart is lost
        if c == 0x09:
            replies.append(Reply(b"\x09\x00"))
        elif c == ord("S"):
            self._streaming = True
        elif c == ord("G"):
            self._once += 1
        elif c in b"\r\n":
            pass
        elif c in b"^?":
            if len(data) < 2:
                return 0
            replies.append(Reply(self._query(data[1]) if c == ord("?") else _UNKNOWN))
            return 2
        elif c in _BINARY_ARGUMENTS:
            end = 1 + _BINARY_ARGUMENTS[c]
            if len(data) < end:
                return 0
            replies.append(Reply(self._set(c, data[1:end])))
            return end
        elif c in b"tufdljwg":
            end, given_up = data.find(b"\r"), data.find(b"\x03")
            if given_up >= 0 and (end < 0 or given_up < end):
                return given_up  # ^C is next
            if end < 0:
                return 0
            if c == ord("g"):
                self._as_text += 1
            else:
                replies.append(Reply(self._text(chr(c), data[1:end])))
            return end + 1
        else:
            replies.append(Reply(_UNKNOWN))
        return 1

    def _query(self, c: int) -> bytes:
        flags = 0x83 | 0x04 * self._on[ord("U")] | 0x10 * self._on[ord("F")] | 0x20 * self._on[ord("D")] | 0x40 * self.right
        answers: dict[int, bytes] = {
            ord("G"): bytes((1 | 2 * self.plugged,)),
            ord("S"): bytes((self.sensors,)),
            ord("N"): bytes((len(self._chosen),)),
            ord("R"): bytes((self.right,)),
            ord("K"): MASKS[self.sensors],
            ord("M"): self._mask,
            ord("P"): bytes((flags, 0, 0)),
            ord("T"): b"".join(w.to_bytes(2, "little") for w in self._words),
            ord("V"): b"2.50",
            ord("v"): b"Version 2.50\r\n",
            ord("i"): f"CyberGlove {self.sensors} sensors, simulated\r\n".encode(),
        } | {s: bytes((on,)) for s, on in self._on.items()}
        return b"?" + bytes((c,)) + answers[c] + b"\0" if c in answers else _UNKNOWN

    def _set(self, c: int, value: bytes) -> bytes:
        if c in _SWITCHES:
            self._on[c] = value in (b"\x01", b"1")
        elif c == ord("N"):
            self._choose(value[0])
        elif c == ord("M"):
            self._mask = value
            self._choose(self.sensors)
        else:
            self._words = (int.from_bytes(value[:2], "little"), int.from_bytes(value[2:], "little"))
        return bytes((c, 0))

    def _choose(self, most: int) -> None:
        """Send the sensors in the mask, at most so many; at least one."""
        there, wanted = (int.from_bytes(m, "little") for m in (MASKS[self.sensors], self._mask))
        slots = [k for k in range(24) if there >> k & 1]
        self._chosen = [i for i, k in enumerate(slots) if wanted >> k & 1][: max(1, most)] or [0]

    def _text(self, c: str, argument: bytes) -> bytes:
        numbers = [int(n) for n in re.findall(rb"\d+", argument)]
        if c == "t" and len(numbers) == 2:
            self._words = (min(numbers[0], 65535), min(numbers[1], 65535))
        elif c != "t" and len(numbers) == 1:
            self._on[ord(c.upper())] = bool(numbers[0])
        else:
            return _UNKNOWN
        return b"\r\0"


def _timestamp(ms: int) -> bytes:
    """Five bytes none of which is 0: a mask of flipped lowest bits, then the time, lowest byte first."""
    t = (ms & 0xFFFFFFFF).to_bytes(4, "little")
    flips = 0x80 | sum(1 << i for i, b in enumerate(t) if b == 0)
    return bytes((flips, *(b ^ (b == 0) for b in t)))

"""CyberGlove, RS-232: bytes in, samples and answers out; commands as bytes.

Sources: CyberGlove III User and Programmer Guide; the framing as used by Virtual Technologies' own library. Every
answer ends in 0x00 and a sensor's value is 1..255, never 0, so a zero ends a sample:

    'S' or 'G' | n sensor values | [5 bytes of time] | [status] | 0x00

'S' and 'G' are legal sensor values too: the place of the zero, not the letter, marks a sample.
"""

from dataclasses import dataclass

from vistel.protocol.arrival import ByteArrivals

SENSORS_22 = (
    "thumb_roll", "thumb_mpj", "thumb_ij", "thumb_abduction",
    "index_mpj", "index_pij", "index_dij",
    "middle_mpj", "middle_pij", "middle_dij", "middle_index_abduction",
    "ring_mpj", "ring_pij", "ring_dij", "ring_middle_abduction",
    "pinky_mpj", "pinky_pij", "pinky_dij", "pinky_ring_abduction",
    "palm_arch", "wrist_pitch", "wrist_yaw",
)  # fmt: skip
"""In the order in which a 22-sensor glove sends them."""
SENSORS_18 = tuple(name for name in SENSORS_22 if not name.endswith("_dij"))
SENSORS = {18: SENSORS_18, 22: SENSORS_22}
MASKS = {18: bytes((0x3F, 0xBB, 0x7B)), 22: bytes((0x7F, 0xFF, 0x7F))}
"""Which of 24 slots (6 groups of 4) are sensors, least significant byte first."""

STATUS_PLUGGED = 0x01
STATUS_ALWAYS = 0x80

_ANSWER_LENGTH = dict.fromkeys(b"GSNRUDFLJW", 1) | dict.fromkeys(b"KMP", 3) | {ord("T"): 4}
_ACKNOWLEDGED = b"UDFLJWMNT"
_MAX_TEXT = 256


@dataclass(frozen=True, slots=True)
class Sample:
    """One sample. values: a byte per sensor; status: the status byte or None; t_ns: when its first byte was sent.

    error: "" or "sampling too fast" or "glove unplugged".
    """

    values: bytes
    status: int | None
    error: str
    t_ns: int


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer to a command. name: "?G", "?i", "U", "^C", "^R", "error", "" to text commands; data: its bytes."""

    name: str
    data: bytes


_TAILS = {b"es": "sampling too fast", b"eg": "glove unplugged"}


class CyberGloveParser:
    """Parses samples and answers of a CyberGlove; skips and counts invalid bytes.

    sensors: values of a sample; status, timestamp: whether these are switched on. They may change at any time.
    """

    def __init__(self, sensors: int = 18, *, status: bool = True, timestamp: bool = False, baud: int = 115200) -> None:
        self.sensors = sensors
        self.status = status
        self.timestamp = timestamp
        self.bytes_skipped = 0
        self._buffer = bytearray()
        self._arrivals = ByteArrivals(baud)
        self._answers: list[Answer] = []

    def feed(self, data: bytes, t_ns: int) -> list[Sample]:
        """The samples completed by `data`, which was read at `t_ns`. Never raises, whatever the bytes."""
        samples: list[Sample] = []
        if not data:
            return samples
        buffer = self._buffer
        buffer += data
        self._arrivals.read(len(data), t_ns)
        base = self._arrivals.end - len(buffer)
        i = 0
        while (zero := buffer.find(0, i)) >= 0:
            end = self._query_end(i, zero)
            if end is None:
                break
            if end > zero:
                self._answers.append(Answer(buffer[i : i + 2].decode("ascii"), bytes(buffer[i + 2 : end])))
                zero = end
            else:
                self._segment(i, zero, base, samples)
            i = zero + 1
        if len(buffer) - i > _MAX_TEXT:  # longer than any text of a glove
            surplus = len(buffer) - i - _MAX_TEXT
            self.bytes_skipped += surplus
            i += surplus
        del buffer[:i]
        self._arrivals.forget(base + i)
        return samples

    def take_answers(self) -> list[Answer]:
        """Answers since the last call, oldest first."""
        answers, self._answers = self._answers, []
        return answers

    def _query_end(self, i: int, zero: int) -> int | None:
        """Index of the final zero of a query's answer at `i` whose value contains zeros; None: incomplete.

        Returns `zero` if there is no such answer.
        """
        b = self._buffer
        if zero - i < 2 or b[i] != ord("?") or b[i + 1] not in _ANSWER_LENGTH:
            return zero
        end = i + 2 + _ANSWER_LENGTH[b[i + 1]]
        if end <= zero:
            return zero
        if end >= len(b):
            return None
        return end if b[end] == 0 else zero

    def _segment(self, i: int, zero: int, base: int, samples: list[Sample]) -> None:
        """Parse the bytes from `i` up to the zero."""
        b = self._buffer
        tail = _TAILS.get(bytes(b[max(i, zero - 2) : zero]), "")
        body = 1 + self.sensors + 5 * self.timestamp + self.status
        for error, end in ((tail, zero - 2), ("", zero)) if tail else (("", zero),):
            # Counted back from the zero, so that garbage before a sample does not spoil it.
            start = end - body
            if start >= i and b[start] in b"SG" and not (self.status and not b[end - 1] & STATUS_ALWAYS):
                self.bytes_skipped += _unexpected(bytes(b[i:start]))
                values = bytes(b[start + 1 : start + 1 + self.sensors])
                status = b[end - 1] if self.status else None
                samples.append(Sample(values, status, error, self._arrivals.began_ns(base + start)))
                return
        answer = _answer(bytes(b[i:zero]))
        if answer is None:
            self.bytes_skipped += zero - i + 1
        else:
            self._answers.append(answer)


def _unexpected(before: bytes) -> int:
    """Number of garbage bytes before a sample; the CR LF of an ASCII command is none."""
    return 0 if not before.strip(b"\r\n") else len(before)


def _answer(segment: bytes) -> Answer | None:
    text = segment.lstrip(b"\r\n ")
    if len(text) > _MAX_TEXT:
        return None
    if not text:
        return Answer("", segment) if segment else None
    if text[:2] == b"e?":
        return Answer("error", text)
    if text[0] in (0x03, 0x12, 0x09) and not text[1:].strip(b"\r\n"):
        return Answer("^" + chr(text[0] + 64), text[1:])
    if text[0] == ord("?") and len(text) > 1 and chr(text[1]).isalpha() and text[1] < 128:
        return Answer(text[:2].decode("ascii"), text[2:])
    if len(text) == 1 and text[0] in _ACKNOWLEDGED:
        return Answer(chr(text[0]), b"")
    return None


# Commands. Capitals are binary, small letters are text that ends in CR.
STOP = b"\x03"
RESTART = b"\x12"
STREAM = b"S"
SAMPLE = b"G"
QUERY_STATE = b"?G"
"""Answer 3 = initialised and plugged in."""
QUERY_SENSORS = b"?S"
QUERY_RIGHT = b"?R"
QUERY_MASK = b"?K"
QUERY_INFO = b"?i"
QUERY_PERIOD = b"?T"
STATUS_ON = b"U\x01"
TIMESTAMP_OFF = b"D\x00"
FILTER_ON = b"F\x01"


def set_mask(mask: bytes) -> bytes:
    """Select the sensors that are sent."""
    return b"M" + mask


def set_count(sensors: int) -> bytes:
    """Set the number of values that are sent."""
    return b"N" + bytes((sensors,))


def set_rate(rate_hz: float) -> bytes:
    """Set the samples per second. As text: drivers disagree about the byte order of the binary form."""
    return f"t {round(115200 / rate_hz)} 1\r".encode()


def rate_of(period: bytes) -> float:
    """Samples per second, from the answer to QUERY_PERIOD (two words, low byte first); 0 if it is invalid."""
    words = [int.from_bytes(period[k : k + 2], "little") for k in (0, 2)] if len(period) == 4 else [0]
    return 115200 / (words[0] * words[1]) if all(words) else 0.0

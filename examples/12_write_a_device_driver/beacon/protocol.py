"""The Beacon's lines: bytes in, samples out.

A Beacon streams at 30 Hz after "G\\n" and falls silent after "H\\n". It answers "?\\n" with "Beacon" and its version. Each other
line is a sample of one receiver, in the tracker's frame (+X forward, +Y right, +Z down):

    station x y z qx qy qz qw *checksum\\n

Positions are in millimetres. The quaternion turns the receiver's axes into the tracker's. The checksum is the sum of all bytes
before the asterisk modulo 256, in decimal.
"""

from dataclasses import dataclass

START = b"G\n"
STOP = b"H\n"
WHO = b"?\n"
ANSWER = b"Beacon 1.0\n"
RATE_HZ = 30.0
_LONGEST = 200
"""A line is shorter [bytes]."""


@dataclass(frozen=True)
class Sample:
    """station: from 1; position [m]; rotation: quaternion (x, y, z, w)."""

    station: int
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


def line_of(sample: Sample) -> bytes:
    """The line of a sample."""
    position = " ".join(f"{1e3 * p:.1f}" for p in sample.position)
    rotation = " ".join(f"{q:.5f}" for q in sample.rotation)
    text = f"{sample.station} {position} {rotation} ".encode()
    return text + b"*%d\n" % (sum(text) % 256)


class Parser:
    """Lines may come in any pieces; what is no line is skipped and counted."""

    def __init__(self) -> None:
        self.bytes_skipped = 0
        self._rest = b""

    def feed(self, data: bytes) -> list[Sample]:
        """The samples that `data` completes."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        found = [(line, _sample(line)) for line in lines]
        self.bytes_skipped += sum(len(line) + 1 for line, sample in found if sample is None)
        if len(self._rest) > _LONGEST:
            self.bytes_skipped += len(self._rest)
            self._rest = b""
        return [sample for _, sample in found if sample is not None]


def _sample(line: bytes) -> Sample | None:
    text, star, checksum = line.partition(b"*")
    try:
        if not star or int(checksum) != sum(text) % 256:
            return None
        station, *numbers = text.split()
        x, y, z, qx, qy, qz, qw = map(float, numbers)
        return Sample(int(station), (x / 1e3, y / 1e3, z / 1e3), (qx, qy, qz, qw))
    except ValueError:
        return None

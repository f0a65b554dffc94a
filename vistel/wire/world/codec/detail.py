"""Where things are exactly that a frame leaves to foresight: how far each is from where the frame has it."""

from collections.abc import Mapping

from vistel.wire.world.codec.bits import BitReader, BitWriter, FrameError
from vistel.wire.world.codec.poses import GridPose

HOLD_STEPS = 120
"""A correction holds until a frame tells of the thing, or until the step passes a multiple of this."""
MOST = 64
"""Things in one detail."""
# Orders of Exp-Golomb codes (`bits`).
_COUNT = 3  # of how many things there are
_GAP = 3  # of how many numbers of things are left out before the next
_ORDER = 1  # of a correction's own order
_MOST_ORDER = 20
"""No correction has a higher order: bytes that say so are no frame."""


def coded(correction: GridPose) -> str:
    """The bits of what to add to a thing's pose in the frame."""
    out = BitWriter()
    for part in (correction[:3], correction[3:]):
        order = (sum(map(abs, part)) // len(part)).bit_length()
        out.count(order, _ORDER)
        out.several(part, order)
    return out.bits


def write_detail(corrections: Mapping[int, str]) -> bytes:
    """corrections: `coded`, by number of the thing."""
    out = BitWriter()
    out.count(len(corrections), _COUNT)
    at = -1
    for n in sorted(corrections):
        out.count(n - at - 1, _GAP)
        out.coded(corrections[n])
        at = n
    return out.to_bytes()


def read_detail(data: bytes) -> dict[int, GridPose]:
    """The other end of `write_detail`. Raises FrameError."""
    bits = BitReader(data)
    count = bits.count(_COUNT)
    if count > MOST:
        raise FrameError("a detail holds too many things")
    out: dict[int, GridPose] = {}
    at = -1
    for _ in range(count):
        at += 1 + bits.count(_GAP)
        out[at] = (*_part(bits, 3), *_part(bits, 4))
    return out


def _part(bits: BitReader, count: int) -> list[int]:
    order = bits.count(_ORDER)
    if order > _MOST_ORDER:
        raise FrameError("a detail holds a number that is none")
    return bits.several(count, order)

"""Who touches whom with which limbs: pairs that begin, change and end."""

from collections.abc import Mapping
from typing import NamedTuple

from vistel.wire.world.codec.bits import BitReader, BitWriter, FrameError

Pair = tuple[int, int]
"""Numbers of two bodies: who is deformed, by whom. Participants come first, things after them."""

FORCE_STEP = 0.1
"""Newtons of the first level; every second level is twice the force."""
MOST_LEVEL = 31
MOST_PRIMITIVES = 4096
MOST_PAIRS = 1 << 20
# Orders of Exp-Golomb codes (`bits`).
_TARGET = 1  # of the number of the deformed body: people come first
_SOURCE = 3  # of the number of the body that deforms it
_GAP = 1  # of how many primitives are left out before the next


class TouchCode(NamedTuple):
    """limbs: bit i is set when primitive i of the deformed body takes part; level: of the force, see `level_of`."""

    limbs: int
    level: int


def level_of(newtons: float) -> int:
    """A force as a level from 0 to MOST_LEVEL, two to an octave."""
    n = int(min(max(newtons, 0.0), 1e6) / FORCE_STEP) + 1
    size = n.bit_length()
    half = (n >> (size - 2)) & 1 if size >= 2 else 0
    return min(2 * (size - 1) + half, MOST_LEVEL)


def force_of(level: int) -> float:
    """Newtons in the middle of a level."""
    low = (1 << (level // 2)) * (1.5 if level % 2 else 1.0)
    return (1.25 * low - 1.0) * FORCE_STEP if level else 0.0


def write_touches(out: BitWriter, before: dict[Pair, TouchCode], now: Mapping[Pair, TouchCode], most: int = MOST_PAIRS) -> bool:
    """What has changed; `before` becomes `now`, but for what goes beyond `most` pairs and has to wait: those that begin or end
    go first. Returns whether anything has changed."""
    changed = sorted(pair for pair in before.keys() | now.keys() if before.get(pair) != now.get(pair))
    if len(changed) > most:
        changed = sorted(sorted(changed, key=lambda pair: (pair in before and pair in now, pair))[:most])
    out.count(len(changed))
    for pair in changed:
        old, new = before.get(pair, TouchCode(0, 0)), now.get(pair)
        out.count(pair[0], _TARGET)
        out.count(pair[1], _SOURCE)
        limbs = new.limbs if new is not None else 0
        _write_set(out, old.limbs ^ limbs)
        if new is None:
            del before[pair]
            continue
        out.flag(new.level != old.level)
        if new.level != old.level:
            out.plain(new.level, 5)
        before[pair] = new
    return bool(changed)


def read_touches(data: BitReader, known: dict[Pair, TouchCode]) -> bool:
    """The other end of `write_touches`; whether anything has changed."""
    count = data.count()
    for _ in range(count):
        pair = data.count(_TARGET), data.count(_SOURCE)
        old = known.get(pair, TouchCode(0, 0))
        limbs = old.limbs ^ _read_set(data)
        if not limbs:
            known.pop(pair, None)
            continue
        known[pair] = TouchCode(limbs, data.plain(5) if data.flag() else old.level)
    return count > 0


def _write_set(out: BitWriter, bits: int) -> None:
    out.count(bits.bit_count())
    at = -1
    while bits:
        low = (bits & -bits).bit_length() - 1
        out.count(low - at - 1, _GAP)
        at = low
        bits &= bits - 1


def _read_set(data: BitReader) -> int:
    bits, at = 0, -1
    for _ in range(data.count()):
        at += 1 + data.count(_GAP)
        if at >= MOST_PRIMITIVES:
            raise FrameError("a frame names a primitive that no body has")
        bits |= 1 << at
    return bits

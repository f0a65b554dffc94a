"""Another decoder of motion frames, written from docs/reference/motion-stream.md alone: plain Python, no arrays.

It shows that the page suffices. Given: the model's file, and the fields as the page of topics lists them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

ALWAYS = ("body", "hands", "stance")
BY_BIT = ("gaze", "face", "lids", "legs", "collars", "jaw")
TENTHS = (5, 7, 10, 14, 20, 28, 40, 56)


@dataclass(frozen=True)
class Field:
    """A row of the table of fields."""

    part: str
    count: int
    low: float
    high: float
    step: float
    group: int


@dataclass
class Key:
    numbers: list[int]
    change: list[int]
    span: int
    t_ns: int
    parts: int
    grain: int
    stale: int


def cut(a: int, b: int) -> int:
    """a / b, cut off towards zero."""
    return -(-a // b) if a < 0 else a // b


class RangeDecoder:
    def __init__(self, data: bytes) -> None:
        self.data, self.at, self.range, self.code = data, 0, 2**32 - 1, 0
        for _ in range(4):
            self.code = self.code * 256 + self.byte()

    def byte(self) -> int:
        self.at += 1
        return self.data[self.at - 1] if self.at <= len(self.data) else 0

    def symbol(self, bits: int, cumulative: Any) -> int:
        r = self.range >> bits
        target = min(self.code // r, 2**bits - 1)
        s = 0
        while cumulative[s + 1] <= target:
            s += 1
        self.code -= r * cumulative[s]
        self.range = r * (cumulative[s + 1] - cumulative[s])
        while self.range < 2**24:
            self.range *= 256
            self.code = (self.code * 256 + self.byte()) % 2**32
        return s

    def raw(self, n: int) -> int:
        return self.symbol(n, range(2**n + 1))

    def flag(self, w: int) -> bool:
        return self.symbol(12, (0, w, 4096)) == 0

    def many(self) -> int:
        count = 0
        while count < 24 and self.raw(1):
            count += 1
        x = 1
        for _ in range(count):
            x = 2 * x + self.raw(1)
        return x - 1


class PlainDecoder:
    def __init__(self, fields: list[Field], model: dict[str, Any]) -> None:
        self.fields = [f for f in fields for _ in range(f.count)]
        self.model = model
        self.keys: dict[int, Key] = {}

    def decode(self, seq: int, t_ns: int, frame: bytes) -> tuple[list[int], int, int] | None:
        """Numbers of all parts (0 where absent), grain, stale bits; None for what cannot be read."""
        if not frame or frame[-1] == 0 or len(frame) > 1024:
            return None
        rc = RangeDecoder(frame)
        distance, keep = 0, True
        if rc.flag(256):
            version, parts, grain = rc.raw(8), rc.raw(8), rc.raw(3)
            if version != 1 or parts >= 2 ** len(BY_BIT):
                return None
            nothing = [0] * len(self.fields)
            key = Key(nothing, nothing, 0, t_ns, parts, grain, 0)
            kind = 0
        else:
            keep = rc.flag(1024)
            short = rc.raw(2)
            distance = short + 1 if short < 3 else 4 + rc.many()
            found = self.keys.get(seq - distance)
            if found is None or not 0 <= t_ns - found.t_ns <= 10**9:
                return None
            key, kind = found, 2 if found.span else 1
        stale = rc.raw(12) if rc.flag(32) else key.stale
        numbers = self._numbers(rc, key, kind, distance)
        if not rc.at - 8 <= len(frame) <= rc.at:
            return None
        if keep:
            change = [a - b for a, b in zip(numbers, key.numbers, strict=True)] if kind else [0] * len(numbers)
            self.keys.pop(seq, None)
            self.keys[seq] = Key(numbers, change, distance, t_ns, key.parts, key.grain, stale)
            if len(self.keys) > 8:
                del self.keys[next(iter(self.keys))]
        return numbers, key.grain, stale

    def _numbers(self, rc: RangeDecoder, key: Key, kind: int, distance: int) -> list[int]:
        m, tenths = self.model, TENTHS[key.grain]
        there = {*ALWAYS, *(p for i, p in enumerate(BY_BIT) if key.parts >> i & 1)}
        rest, size = [0] * len(self.fields), [0] * len(self.fields)
        groups: dict[int, int] = {}
        near = near2 = everything = 0
        reach = min(distance, 2 * key.span)
        out: list[int] = []
        for c, f in enumerate(self.fields):
            if f.part not in there:
                out.append(0)
                continue
            g, weights = f.group, [row[f.group] for row in m["weights"][kind]]
            if kind == 0:
                expected = cut(m["mean"][c] * 10, tenths)
            elif kind == 1:
                expected = key.numbers[c]
            else:
                expected = key.numbers[c] + cut(key.change[c] * m["go_on"][c] * reach, 256 * key.span)
            base, p = expected, m["partner"][c]
            partner = p >= 0 and self.fields[p].part in there
            if partner:
                expected += cut(rest[p] * m["follow"][kind][c], 256)
            low, high = -(-round(f.low / f.step) * 10 // tenths), round(f.high / f.step) * 10 // tenths
            expected = min(max(expected, low), high)
            lowered = (key.grain - 2) * (1024 - min(1024, 16 * sum(weights)) >> 1)
            about = m["bias"][kind][c] - lowered + m["age"][kind][g][min(distance, 32) - 1 if kind else 0]
            seen = (near, near2, groups.get(g, 0) >> 4, everything >> 4)
            about += sum(w * self._log(x) for w, x in zip(weights, seen, strict=False))
            if kind == 2:
                about += weights[4] * self._log(abs(key.change[c]) * reach // key.span)
            if partner:
                about += weights[5] * self._log(size[p])
            k = min(max(about >> 9, 0), 25)
            h = rc.symbol(15, m["cumulative"][k]) - 20
            if h == -20:
                h -= rc.many()
            elif h == 20:
                h += rc.many()
            shift = m["shifts"][k]
            left = (h << shift) + (rc.raw(shift) if shift else 0)
            n = min(max(expected + left, low), high)
            out.append(n)
            rest[c], size[c] = n - base, min(abs(left), 4095)
            near2, near = near, size[c]
            groups[g] = groups.get(g, 0) + (64 * size[c] - groups.get(g, 0) >> 1)
            everything += 64 * size[c] - everything >> 3
        return out

    def _log(self, x: int) -> int:
        more = 0
        while x >= 64:
            x >>= 1
            more += 16
        return self.model["logs"][x] + more

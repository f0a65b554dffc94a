"""Numbers of any size as bits: Exp-Golomb codes, which spend few bits on the small ones."""

from collections.abc import Iterable

MOST_ZEROS = 32
"""Before the first digit of a number: none has more digits."""


class FrameError(ValueError):
    """Bytes that are no frame."""


class BitWriter:
    """Bits in the order they are written, the highest of a number first."""

    def __init__(self) -> None:
        self._parts: list[str] = []

    def flag(self, value: bool) -> None:
        """One bit."""
        self._parts.append("1" if value else "0")

    def plain(self, value: int, bits: int) -> None:
        """A number from 0 to 2**bits - 1."""
        self._parts.append(f"{value:0{bits}b}")

    def count(self, value: int, order: int = 0) -> None:
        """A number from 0, Exp-Golomb of an order: those below 2**order take order + 1 bits."""
        digits = f"{value + (1 << order):b}"
        self._parts.append("0" * (len(digits) - 1 - order) + digits)

    def signed(self, value: int, order: int = 0) -> None:
        """A number of either sign; 0, 1, -1, 2, ... take more and more bits."""
        self.count(2 * value - 1 if value > 0 else -2 * value, order)

    def several(self, values: Iterable[int], order: int) -> None:
        """Each as `signed` does, in one go."""
        add, least = self._parts.append, 1 << order
        for value in values:
            digits = f"{(2 * value - 1 if value > 0 else -2 * value) + least:b}"
            add("0" * (len(digits) - 1 - order) + digits)

    def coded(self, bits: str) -> None:
        """What another writer has written."""
        self._parts.append(bits)

    @property
    def bits(self) -> str:
        """Everything, as noughts and ones."""
        return "".join(self._parts)

    def to_bytes(self) -> bytes:
        """Everything, filled with zeros to a whole byte."""
        text = self.bits
        size = (len(text) + 7) // 8
        return int(text.ljust(8 * size, "0"), 2).to_bytes(size, "big") if size else b""


class BitReader:
    """What a `BitWriter` wrote. Reading raises FrameError where the bytes end too early."""

    def __init__(self, data: bytes) -> None:
        marked = int.from_bytes(b"\x01" + data, "big")
        self._text = f"{marked:b}"
        self._at = 1

    def flag(self) -> bool:
        """One bit."""
        at = self._at
        if at >= len(self._text):
            raise FrameError("a frame ends too early")
        self._at = at + 1
        return self._text[at] == "1"

    def plain(self, bits: int) -> int:
        """A number from 0 to 2**bits - 1."""
        end = self._at + bits
        if end > len(self._text):
            raise FrameError("a frame ends too early")
        value = int(self._text[self._at : end], 2)
        self._at = end
        return value

    def count(self, order: int = 0) -> int:
        """A number from 0."""
        first = self._text.find("1", self._at)
        zeros = first - self._at
        if first < 0 or zeros > MOST_ZEROS:
            raise FrameError("a frame holds a number that is none")
        self._at = first
        return self.plain(zeros + order + 1) - (1 << order)

    def signed(self, order: int = 0) -> int:
        """A number of either sign."""
        value = self.count(order)
        return (value + 1) // 2 if value & 1 else -(value // 2)

    def several(self, count: int, order: int) -> list[int]:
        """Numbers written by `BitWriter.several`."""
        text, at, least = self._text, self._at, 1 << order
        out: list[int] = []
        for _ in range(count):
            first = text.find("1", at)
            end = 2 * first - at + order + 1
            if first < 0 or first - at > MOST_ZEROS or end > len(text):
                raise FrameError("a frame holds a number that is none")
            value = int(text[first:end], 2) - least
            out.append((value + 1) >> 1 if value & 1 else -(value >> 1))
            at = end
        self._at = at
        return out

    @property
    def left(self) -> int:
        """Bits not read."""
        return len(self._text) - self._at

"""Text that LZString has compressed to base64, as recorders in browsers keep it (pieroxy.net/blog/pages/lz-string).

It is LZ78: a code is a letter that is new, or a word that was seen, and each code adds a word, the one before it with one letter
more. Codes grow by a bit whenever that many words are known.
"""

_LETTERS = {c: i for i, c in enumerate("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=")}
_END = 2
"""The code after the last one."""


class LzStringError(ValueError):
    """Text that is not LZString's, or becomes too long."""


class _Bits:
    """Six bits of a letter, the highest first; numbers come with their lowest bit first."""

    def __init__(self, text: str) -> None:
        try:
            self._values = [_LETTERS[c] for c in text.strip()]
        except KeyError as e:
            raise LzStringError(f"{e.args[0]!r} is no letter of base64") from None
        self._at = 0

    def take(self, count: int) -> int:
        """The next number of `count` bits."""
        if self._at + count > 6 * len(self._values):
            raise LzStringError("it is cut off")
        out = 0
        for k in range(count):
            letter, bit = divmod(self._at, 6)
            out |= (self._values[letter] >> (5 - bit) & 1) << k
            self._at += 1
        return out

    def letter(self, wide: int) -> str:
        """A new letter, of 16 bits if `wide`, else of 8."""
        return chr(self.take(16 if wide else 8))


def decompressed(text: str, most: int) -> str:
    """What `compressToBase64` was given. most: letters that it may have. Raises LzStringError."""
    bits = _Bits(text)
    first = bits.take(2)
    if first == _END:
        return ""
    word = bits.letter(first)
    words: dict[int, str] = {3: word}
    out, length, size, left, width = [word], 1, 4, 4, 3
    while True:
        code = bits.take(width)
        if code == _END:
            return "".join(out)
        if code < _END:
            words[size] = bits.letter(code)
            code, size, left = size, size + 1, left - 1
            if left == 0:
                left, width = 1 << width, width + 1
        if code > size:
            raise LzStringError("it names a word that it has not")
        entry = words.get(code, word + word[0])
        length += len(entry)
        if length > most:
            raise LzStringError(f"it becomes longer than {most} letters")
        out.append(entry)
        words[size] = word + entry[0]
        size, left, word = size + 1, left - 1, entry
        if left == 0:
            left, width = 1 << width, width + 1

"""Kana as it is read, however it was written: katakana, romaji, long vowels."""

from vistel.speech.phones import hiragana

_VOWELS = "aiueo"
_ROWS = {
    "": "あいうえお", "k": "かきくけこ", "s": "さ せそ", "t": "た  てと", "n": "なにぬねの", "h": "はひ へほ", "m": "まみむめも",
    "r": "らりるれろ", "g": "がぎぐげご", "z": "ざ ずぜぞ", "d": "だ  でど", "b": "ばびぶべぼ", "p": "ぱぴぷぺぽ",
    "y": "や ゆ よ", "w": "わ   を",
}  # fmt: skip
_YOUON = {"ky": "き", "gy": "ぎ", "sh": "し", "j": "じ", "ch": "ち", "ny": "に", "hy": "ひ", "by": "び", "py": "ぴ", "my": "み",
          "ry": "り"}  # fmt: skip
_SYLLABLES = (
    {row + v: kana for row, line in _ROWS.items() for v, kana in zip(_VOWELS, line, strict=False) if kana != " "}
    | {row + v: kana + small for row, kana in _YOUON.items() for v, small in (("a", "ゃ"), ("u", "ゅ"), ("o", "ょ"))}
    | {"shi": "し", "si": "し", "chi": "ち", "ti": "ち", "tsu": "つ", "tu": "つ", "fu": "ふ", "hu": "ふ", "ji": "じ", "zi": "じ"}
    | {"she": "しぇ", "che": "ちぇ", "je": "じぇ", "fa": "ふぁ", "fi": "ふぃ", "fe": "ふぇ", "fo": "ふぉ"}
    | {"dhi": "でぃ", "thi": "てぃ"}
)
_VOWEL_OF = {kana[-1]: "あいうえお"[_VOWELS.index(romaji[-1])] for romaji, kana in _SYLLABLES.items()} | {"づ": "う", "ぢ": "い"}

_SAME = str.maketrans("をづぢへ", "おずじえ")


def reading(text: str) -> str:
    """One spelling for what sounds the same: hiragana, no spaces or punctuation, long vowels written out,
    を and へ as they are said of particles."""
    out = ""
    for c in hiragana(text).translate(_SAME):
        if c == "ー":
            out += _VOWEL_OF.get(out[-1:], "")
        elif c.isalnum():
            out += c
    return out


_ROMAJI = {kana: romaji for romaji, kana in reversed(_SYLLABLES.items())} | {"ん": "n", "ー": "-", "し": "shi", "ち": "chi"}


def to_romaji(text: str) -> str:
    """Kana in Hepburn's letters, for where no Japanese can be drawn; everything else stays."""
    rest, out = hiragana(text), ""
    while rest:
        size = next((n for n in (2, 1) if rest[:n] in _ROMAJI), 0)
        if rest[0] == "っ" and rest[1:2] in _ROMAJI:
            out, rest = out + _ROMAJI[rest[1]][0], rest[1:]
        else:
            out, rest = out + (_ROMAJI[rest[:size]] if size else rest[0]), rest[max(1, size) :]
    return out


def from_romaji(text: str) -> str:
    """Hiragana of romaji (Hepburn or Kunrei; ī, ii and i- are long alike). Raises ValueError at what is none."""
    long = {"ā": "aa", "ī": "ii", "ū": "uu", "ē": "ee", "ō": "ou"}
    rest = "".join(long.get(c, c) for c in text.lower())
    out = ""
    while rest:
        c = rest[0]
        if c.isspace() or c in "'.,!?":
            rest = rest[1:]
        elif c == "-":
            out, rest = out + "ー", rest[1:]
        elif len(rest) > 1 and rest[1] == c and c not in "aiueon":
            out, rest = out + "っ", rest[1:]
        else:
            size = next((n for n in (3, 2, 1) if rest[:n] in _SYLLABLES), 0)
            if size:
                out, rest = out + _SYLLABLES[rest[:size]], rest[size:]
            elif c == "n":
                out, rest = out + "ん", rest[1:]
            else:
                raise ValueError(f"expected romaji, got {rest[:4]!r} in {text!r}")
    return out

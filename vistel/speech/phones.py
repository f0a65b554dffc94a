"""The sounds of Japanese, and how kana are said."""

import unicodedata

PAUSE = "pau"
PHONES = (
    PAUSE, "a", "i", "u", "e", "o", "N", "cl", "k", "g", "s", "z", "sh", "j", "t", "d", "ts", "ch", "n", "h", "f", "b",
    "p", "m", "y", "r", "w", "ky", "gy", "ny", "hy", "by", "py", "my", "ry",
)  # fmt: skip
"""Silence and noise, vowels, the moraic nasal, the pause of a doubled consonant, consonants. A vowel said twice is a
long one. Devoiced vowels are vowels here: the acoustic model knows both ways of saying them."""

_VOWELS = frozenset("aiueo")

_KANA = """
あ a い i う u え e お o ぁ a ぃ i ぅ u ぇ e ぉ o ん N っ cl
か k,a き k,i く k,u け k,e こ k,o が g,a ぎ g,i ぐ g,u げ g,e ご g,o
さ s,a し sh,i す s,u せ s,e そ s,o ざ z,a じ j,i ず z,u ぜ z,e ぞ z,o
た t,a ち ch,i つ ts,u て t,e と t,o だ d,a ぢ j,i づ z,u で d,e ど d,o
な n,a に n,i ぬ n,u ね n,e の n,o は h,a ひ h,i ふ f,u へ h,e ほ h,o
ば b,a び b,i ぶ b,u べ b,e ぼ b,o ぱ p,a ぴ p,i ぷ p,u ぺ p,e ぽ p,o
ま m,a み m,i む m,u め m,e も m,o や y,a ゆ y,u よ y,o ゃ y,a ゅ y,u ょ y,o
ら r,a り r,i る r,u れ r,e ろ r,o わ w,a ゐ i ゑ e を o ゎ w,a ゔ b,u
きゃ ky,a きゅ ky,u きょ ky,o ぎゃ gy,a ぎゅ gy,u ぎょ gy,o しゃ sh,a しゅ sh,u しょ sh,o しぇ sh,e
じゃ j,a じゅ j,u じょ j,o じぇ j,e ぢゃ j,a ぢゅ j,u ぢょ j,o ちゃ ch,a ちゅ ch,u ちょ ch,o ちぇ ch,e
にゃ ny,a にゅ ny,u にょ ny,o ひゃ hy,a ひゅ hy,u ひょ hy,o びゃ by,a びゅ by,u びょ by,o
ぴゃ py,a ぴゅ py,u ぴょ py,o みゃ my,a みゅ my,u みょ my,o りゃ ry,a りゅ ry,u りょ ry,o
ふぁ f,a ふぃ f,i ふぇ f,e ふぉ f,o ふゅ f,y,u てぃ t,i でぃ d,i とぅ t,u どぅ d,u てゅ t,y,u でゅ d,y,u
うぃ w,i うぇ w,e うぉ w,o つぁ ts,a つぃ ts,i つぇ ts,e つぉ ts,o くぁ k,w,a くぃ k,w,i くぇ k,w,e くぉ k,w,o
ぐぁ g,w,a ゔぁ b,a ゔぃ b,i ゔぇ b,e ゔぉ b,o いぇ i,e すぃ s,i ずぃ z,i
"""
_PHONES = dict(zip(_KANA.split()[::2], (tuple(each.split(",")) for each in _KANA.split()[1::2]), strict=True))
_SPACE = frozenset(" 　、。，．！？!?・,.")


def hiragana(text: str) -> str:
    """Katakana (also of half width) as hiragana; everything else stays."""
    wide = unicodedata.normalize("NFKC", text)
    return "".join(chr(ord(c) - 0x60) if "ァ" <= c <= "ヴ" else c for c in wide)


def kana_phones(text: str) -> tuple[str, ...]:
    """How a word in kana is said: ("m", "i", "g", "i", "n", "i") for みぎに.

    おう is said as a long o and えい as a long e (ほうこう, ていねい); where they are two sounds (おもう, of a verb) an
    apostrophe keeps them apart: おも'う. A long mark repeats the vowel. Spaces and punctuation say nothing. The
    particles は and へ are written as they are said: わ, え. Raises ValueError that names a letter which is no kana.
    """
    kana = hiragana(text)
    phones: list[str] = []
    apart = True
    at = 0
    while at < len(kana):
        two, one = kana[at : at + 2], kana[at]
        if len(two) == 2 and two in _PHONES:
            phones.extend(_PHONES[two])
            at += 2
            apart = False
            continue
        at += 1
        if one in _SPACE or one == "'":
            apart = True
            continue
        if one == "ー" and phones and phones[-1] in _VOWELS:
            phones.append(phones[-1])
        elif one in _PHONES:
            long = not apart and phones and (phones[-1], one) in (("o", "う"), ("e", "い"))
            phones.extend((phones[-1],) if long else _PHONES[one])
        else:
            raise ValueError(f"pronunciation of {text!r}: {one!r} is not kana; write how the word is said in hiragana")
        apart = False
    return tuple(phones)


def kana_ways(text: str) -> tuple[tuple[str, ...]]:
    """The one way to say a word in kana, for `Grammar.patterns`. Raises as `kana_phones`."""
    return (kana_phones(text),)


_LABELS = {"sil": PAUSE, "v": "b", "xx": PAUSE}
_SPLIT = {"ty": ("t", "y"), "dy": ("d", "y"), "kw": ("k", "w"), "gw": ("g", "w"), "fy": ("f", "y")}


def label_phones(label: str) -> tuple[str, ...]:
    """Phones of PHONES for the phone name of an Open JTalk label. Raises ValueError that names an unknown one."""
    name = _LABELS.get(label, label.lower() if label in "AIUEO" else label)
    known = _SPLIT.get(name, (name,))
    if any(each not in PHONES for each in known):
        raise ValueError(f"label: unknown phone {label!r}")
    return known

"""What the Japanese net is made from: three people and mixtures of them through Open JTalk, and espeak-ng."""

from pathlib import Path

import numpy as np

from scripts.speech_model import voice_file, voices
from scripts.speech_model.corpus import PACK, Corpus, seeded
from scripts.speech_model.texts import training_texts
from scripts.speech_model.voices import Manner, Spoken, drawn, espeak, hts_voices, mixed, open_jtalk
from vistel.speech.phones import PHONES

HTS_TRAINING = {
    "nitech_jp_atr503_m001": 2,
    "tohoku-f01-neutral": 2,
    "tohoku-f01-happy": 2,
    "tohoku-f01-sad": 2,
    "tohoku-f01-angry": 2,
    "takumi_normal": 2,
    "takumi_happy": 2,
    "takumi_angry": 2,
}
"""Packs of each voice. The voice "mei" and the ESPEAK_TEST variants are held out for tests."""
HTS_MIXED = (*HTS_TRAINING, "takumi_sad")
"""Voices of which everybody in the packs "mixed" is made, no one of them alone. "takumi_sad" is for choosing settings."""
MIXED_PACKS = 10
ESPEAK_TRAINING = (
    "m1", "m2", "m3", "m4", "m6", "f1", "f2", "f4", "Andy", "Annie", "Denis", "Gene", "Henrique", "Iven", "Jacky", "Lee", "Mario",
    "Michael", "Mike", "Pedro", "Steph", "Alex", "anika", "norbert",
)  # fmt: skip
ESPEAK_TEST = ("m7", "f3", "Max", "Linda", "travis")
ESPEAK_PACKS = 2


def packs() -> list[tuple[str, int]]:
    """(voice, number) of every pack, voices taken in turn so that the first packs already hold them all."""
    turns = sorted((k, voice) for voice, count in HTS_TRAINING.items() for k in range(count))
    others = [("mixed", k) for k in range(MIXED_PACKS)] + [("espeak", k) for k in range(ESPEAK_PACKS)]
    return [(voice, k) for k, voice in turns] + others


def say_pack(voice: str, number: int, seed: int, alike: Path) -> list[Spoken]:
    """A hundred sentences of one voice, each in another manner; in packs "mixed" and "espeak" each by somebody else.

    alike: folder with the voices of HTS_MIXED made alike.
    """
    random = seeded(seed, voice, number)
    texts = training_texts(random)
    return [_say(voice, next(texts), random, alike) for _ in range(PACK)]


def _say(voice: str, text: str, random: np.random.Generator, alike: Path) -> Spoken:
    if voice == "mixed":
        return mixed(text, shares(random), alike, drawn(random))
    if voice != "espeak":
        return open_jtalk(text, hts_voices()[voice], drawn(random))
    phones, kana = reading_of(text)
    variant = ESPEAK_TRAINING[random.integers(len(ESPEAK_TRAINING))]
    return Spoken(espeak(kana, f"ja+{variant}", int(random.integers(110, 190)), int(random.integers(20, 80))), phones, None)


def shares(random: np.random.Generator) -> dict[str, float]:
    """Two or three voices and how much of each: somebody who does not exist. None has more than 0.8."""
    names = [HTS_MIXED[k] for k in random.permutation(len(HTS_MIXED))[: random.integers(2, 4)]]
    parts = random.dirichlet(np.full(len(names), 1.5))
    parts = 0.7 * np.minimum(parts, 0.8) + 0.3 / len(names)
    return {name: float(part) for name, part in zip(names, parts / parts.sum(), strict=True)}


_SPELT = {"N": "ン", "cl": "ッ", "a": "ア", "i": "イ", "u": "ウ", "e": "エ", "o": "オ"}
_ROWS = {
    "k": "カキクケコ", "g": "ガギグゲゴ", "s": "サスィスセソ", "z": "ザズィズゼゾ", "sh": "シャシシュシェショ",
    "j": "ジャジジュジェジョ",
    "t": "タティトゥテト", "d": "ダディドゥデド", "ts": "ツァツィツツェツォ", "ch": "チャチチュチェチョ", "n": "ナニヌネノ",
    "h": "ハヒフヘホ", "f": "ファフィフフェフォ", "b": "バビブベボ", "p": "パピプペポ", "m": "マミムメモ", "y": "ヤイユイェヨ",
    "r": "ラリルレロ", "w": "ワウィウウェウォ",
}  # fmt: skip

_SMALL = dict(zip(("ky", "gy", "ny", "hy", "by", "py", "my", "ry"), "キギニヒビピミリ", strict=True))


def _row(row: str) -> list[str]:
    cells: list[str] = []
    for c in row:
        if c in "ァィゥェォャュョ":
            cells[-1] += c
        else:
            cells.append(c)
    return cells


def _spell(phones: tuple[str, ...]) -> str:
    """Katakana that is said with these phones."""
    out = ""
    at = 0
    while at < len(phones):
        phone = phones[at]
        vowel = phones[at + 1] if at + 1 < len(phones) else ""
        if phone in _SPELT:
            out += "ー" if at and phone in "aiueo" and phones[at - 1] == phone else _SPELT[phone]
            at += 1
        elif phone == "pau":
            out += "、" if 0 < at < len(phones) - 1 else ""
            at += 1
        elif vowel in tuple("aiueo"):
            if phone in _ROWS:
                cells = _row(_ROWS[phone])
                out += cells["aiueo".index(vowel)]
            else:
                out += _SMALL[phone] + "ャィュェョ"["aiueo".index(vowel)]
            at += 2
        else:
            out += {"s": "ス", "k": "ク", "t": "ト", "d": "ド"}.get(phone, "")
            at += 1
    return out


def reading_of(text: str) -> tuple[tuple[str, ...], str]:
    """Phones of a sentence by Open JTalk's reading of it, whichever the voice, and katakana that espeak-ng reads with the same."""
    phones = open_jtalk(text, next(iter(hts_voices().values())), Manner(rate=20.0)).phones
    return phones, _spell(phones)


def _lacking() -> str | None:
    absent = sorted(set(HTS_MIXED) - set(hts_voices()))
    return voices.missing() or (f"voices not found: {', '.join(absent)}; name their folders in VISTEL_VOICES" if absent else None)


def _prepare(alike: Path) -> None:
    for name in HTS_MIXED:
        voice_file.alike(hts_voices()[name], alike / f"{name}.htsvoice")


JAPANESE = Corpus(
    "japanese",
    _lacking,
    _prepare,
    tuple(packs()),
    say_pack,
    tuple(f"{voice}.0" for voice in HTS_TRAINING),
    ("espeak",),
    26,
    0.75,
    phones=PHONES,
)

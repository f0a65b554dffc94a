"""Clean speech of the training voices, kept on disk in packs of a hundred sentences."""

import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from scripts.speech_model.texts import training_texts
from scripts.speech_model.voices import Manner, Spoken, drawn, espeak, hts_voices, mixed, open_jtalk
from vistel.speech.phones import PHONES
from vistel.whole_file import whole_file

PACK = 100
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


def seeded(*parts: object) -> np.random.Generator:
    """A generator for what the parts name: the same on every machine."""
    return np.random.default_rng([zlib.crc32(repr(part).encode()) for part in parts])


def packs() -> list[tuple[str, int]]:
    """(voice, number) of every pack, voices taken in turn so that the first packs already hold them all."""
    turns = sorted((k, voice) for voice, count in HTS_TRAINING.items() for k in range(count))
    others = [("mixed", k) for k in range(MIXED_PACKS)] + [("espeak", k) for k in range(ESPEAK_PACKS)]
    return [(voice, k) for k, voice in turns] + others


def pack_file(folder: Path, voice: str, number: int) -> Path:
    return folder / f"{voice}.{number}.npz"


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


def save_pack(path: Path, said: list[Spoken]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    sound = np.concatenate([np.rint(np.clip(each.sound, -1, 1) * 32767).astype(np.int16) for each in said])
    none = [np.full(len(each.phones), np.nan) for each in said]
    ends = np.concatenate([n if each.ends_s is None else each.ends_s for each, n in zip(said, none, strict=True)])
    phones = np.array([PHONES.index(p) for each in said for p in each.phones], np.int16)
    sizes = np.array([(len(each.sound), len(each.phones)) for each in said])
    with whole_file(path) as stream:
        np.savez(stream, sound=sound, phones=phones, ends=ends, sizes=sizes)


def load_pack(path: Path) -> Iterator[Spoken]:
    with np.load(path) as data:
        sound, phones, ends, sizes = (data[name] for name in ("sound", "phones", "ends", "sizes"))
    samples, count = np.cumsum(np.vstack([[0, 0], sizes]), 0).T
    for k in range(len(sizes)):
        end = ends[count[k] : count[k + 1]]
        yield Spoken(
            sound[samples[k] : samples[k + 1]].astype(np.float32) / 32768.0,
            tuple(PHONES[p] for p in phones[count[k] : count[k + 1]]),
            None if np.isnan(end).any() else end,
        )

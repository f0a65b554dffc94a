"""Clean speech of the training voices, kept on disk in packs of a hundred sentences."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from scripts.speech_model.texts import training_texts
from scripts.speech_model.voices import Spoken, drawn, espeak, hts_voices, open_jtalk
from vistel.speech.phones import PHONES

PACK = 100
HTS_TRAINING = {
    "nitech_jp_atr503_m001": 8,
    "tohoku-f01-neutral": 3,
    "tohoku-f01-happy": 3,
    "tohoku-f01-sad": 3,
    "tohoku-f01-angry": 3,
}
"""Packs of each voice. The voice "mei" and the ESPEAK_TEST variants are held out for tests."""
ESPEAK_TRAINING = (
    "m1", "m2", "m3", "m4", "m6", "f1", "f2", "f4", "Andy", "Annie", "Denis", "Gene", "Henrique", "Iven", "Jacky", "Lee", "Mario",
    "Michael", "Mike", "Pedro", "Steph", "Alex", "anika", "norbert",
)  # fmt: skip
ESPEAK_TEST = ("m7", "f3", "Max", "Linda", "travis")
ESPEAK_PACKS = 4


@dataclass(frozen=True)
class Utterance:
    voice: str
    spoken: Spoken


def seeded(*parts: object) -> np.random.Generator:
    """A generator for what the parts name: the same on every machine."""
    return np.random.default_rng([zlib.crc32(repr(part).encode()) for part in parts])


def packs() -> list[tuple[str, int]]:
    """(voice, number) of every pack, voices taken in turn so that the first packs already hold them all."""
    turns = sorted((k, voice) for voice, count in HTS_TRAINING.items() for k in range(count))
    return [(voice, k) for k, voice in turns] + [("espeak", k) for k in range(ESPEAK_PACKS)]


def pack_file(folder: Path, voice: str, number: int) -> Path:
    return folder / f"{voice}.{number}.npz"


def say_pack(voice: str, number: int, seed: int) -> list[Spoken]:
    """A hundred sentences of one voice, each in another manner; espeak-ng changes voice with every sentence."""
    random = seeded(seed, voice, number)
    said: list[Spoken] = []
    texts = training_texts(random)
    while len(said) < PACK:
        text = next(texts)
        if voice != "espeak":
            said.append(open_jtalk(text, hts_voices()[voice], drawn(random)))
            continue
        phones, kana = reading_of(text)
        variant = ESPEAK_TRAINING[random.integers(len(ESPEAK_TRAINING))]
        sound = espeak(kana, variant, int(random.integers(110, 190)), int(random.integers(20, 80)))
        said.append(Spoken(sound, phones, None))
    return said


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
    """Phones of a sentence by Open JTalk's reading of it, and katakana that espeak-ng reads with the same."""
    phones = open_jtalk(text, next(iter(hts_voices().values())), _PLAIN).phones
    return phones, _spell(phones)


_PLAIN = drawn(np.random.default_rng(0))


def save_pack(path: Path, said: list[Spoken]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    sound = np.concatenate([np.rint(np.clip(each.sound, -1, 1) * 32767).astype(np.int16) for each in said])
    none = [np.full(len(each.phones), np.nan) for each in said]
    ends = np.concatenate([n if each.ends_s is None else each.ends_s for each, n in zip(said, none, strict=True)])
    phones = np.array([PHONES.index(p) for each in said for p in each.phones], np.int16)
    sizes = np.array([(len(each.sound), len(each.phones)) for each in said])
    part = path.with_suffix(".part.npz")
    np.savez(part, sound=sound, phones=phones, ends=ends, sizes=sizes)
    part.rename(path)


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


def first(folder: Path, count: int) -> list[Path]:
    """Files of the first packs that are there."""
    there = (pack_file(folder, voice, k) for voice, k in packs())
    return list(islice((path for path in there if path.is_file()), count))

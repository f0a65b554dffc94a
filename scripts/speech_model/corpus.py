"""What the nets are made from: clean speech of the training voices, kept on disk in packs of a hundred sentences."""

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scripts.speech_model.training import HIDDEN, OFFSETS
from scripts.speech_model.voices import Spoken
from vistel.whole_file import whole_file

PACK = 100


@dataclass(frozen=True, kw_only=True)
class Net:
    """What a net hears and tells, and how large it is. phones: what it tells apart, the pause first. offsets: frames that it hears,
    as of `AcousticModel`; hidden: widths of its layers. throats: as `frames.session`."""

    phones: tuple[str, ...]
    offsets: tuple[int, ...] = OFFSETS
    hidden: tuple[int, ...] = HIDDEN
    throats: bool = False


@dataclass(frozen=True)
class Corpus(Net):
    """Of a language.

    name: of the model; lacking: why it cannot be spoken here, in one line, or None; prepare: what is done
    in a folder of its own before; packs: (voice, number) of each; say: a pack by voice, number, seed and that folder. first:
    packs, as "voice.number", whose times the synthesiser tells and from which the first net learns; aligned: voices whose times
    that net finds. rounds: how often each utterance is heard, each time somewhere else; share: of the frames of a round that are
    learnt from.
    """

    name: str
    lacking: Callable[[], str | None]
    prepare: Callable[[Path], None]
    packs: tuple[tuple[str, int], ...]
    say: Callable[[str, int, int, Path], list[Spoken]]
    first: tuple[str, ...]
    aligned: tuple[str, ...]
    rounds: int
    share: float


def seeded(*parts: object) -> np.random.Generator:
    """A generator for what the parts name: the same on every machine."""
    return np.random.default_rng([zlib.crc32(repr(part).encode()) for part in parts])


def pack_file(folder: Path, voice: str, number: int) -> Path:
    return folder / f"{voice}.{number}.npz"


def save_pack(path: Path, said: list[Spoken], known: Sequence[str]) -> None:
    """known: all phones of the language."""
    path.parent.mkdir(parents=True, exist_ok=True)
    sound = np.concatenate([np.rint(np.clip(each.sound, -1, 1) * 32767).astype(np.int16) for each in said])
    none = [np.full(len(each.phones), np.nan) for each in said]
    ends = np.concatenate([n if each.ends_s is None else each.ends_s for each, n in zip(said, none, strict=True)])
    phones = np.array([known.index(p) for each in said for p in each.phones], np.int16)
    sizes = np.array([(len(each.sound), len(each.phones)) for each in said])
    with whole_file(path) as stream:
        np.savez(stream, sound=sound, phones=phones, ends=ends, sizes=sizes)


def load_pack(path: Path, known: Sequence[str]) -> Iterator[Spoken]:
    """As `save_pack` kept them."""
    with np.load(path) as data:
        sound, phones, ends, sizes = (data[name] for name in ("sound", "phones", "ends", "sizes"))
    samples, count = np.cumsum(np.vstack([[0, 0], sizes]), 0).T
    for k in range(len(sizes)):
        end = ends[count[k] : count[k + 1]]
        yield Spoken(
            sound[samples[k] : samples[k + 1]].astype(np.float32) / 32768.0,
            tuple(known[p] for p in phones[count[k] : count[k + 1]]),
            None if np.isnan(end).any() else end,
        )

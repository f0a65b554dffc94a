"""What the voices are made to say: commands, everyday talk, and words that do not exist.

`TRAIN` and `TEST` have no sentence frame and few words in common, so that other talk in a test is new to the model.
"""

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

_WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
_COMMAND: dict[str, list[str]] = _WORDS["command"]
_MORAE: list[str] = _WORDS["made_up"]["morae"]
ENGLISH: dict[str, str] = _WORDS["english"]
"""Lists, spaces between: common words in which every sound occurs; accents and variants of espeak-ng."""


@dataclass(frozen=True)
class Talk:
    """Everyday sentences: every choice of one word of each column of one frame is a sentence. between: what words are joined by."""

    frames: Sequence[Sequence[Sequence[str]]]
    between: str = ""

    def sentence(self, random: np.random.Generator) -> str:
        frame = self.frames[random.integers(len(self.frames))]
        return self.between.join(column[random.integers(len(column))] for column in frame).strip()


TRAIN = Talk(_WORDS["talk"]["train"])
TEST = Talk(_WORDS["talk"]["test"])


def command(random: np.random.Generator) -> str:
    """Something one might say to the things of a room; the words of the room's grammar and others beside them."""

    def one(some: Sequence[str]) -> str:
        return some[random.integers(len(some))]

    def word(kind: str) -> str:
        return one(_COMMAND[kind])

    def thing() -> str:
        return word("pointed") if random.random() < 0.3 else word("which") + word("sizes") + word("colours") + word("things")

    kind = random.random()
    if kind < 0.12:
        return word("alone")
    if kind < 0.25:
        return word("degrees") + word("where") + word("verbs")
    if kind < 0.4:
        return thing() + one(("を", "")) + thing() + "にくっつけて"
    if kind < 0.6:
        return word("degrees") + word("where") + thing() + one(("を", "を", "")) + word("verbs")
    return thing() + one(("を", "を", "")) + word("degrees") + word("where") + word("verbs")


def made_up(random: np.random.Generator) -> str:
    """Words of no language, in katakana: every sound beside every other."""
    words: list[str] = []
    for _ in range(random.integers(1, 4)):
        word = ""
        for place in range(random.integers(2, 6)):
            word += _MORAE[random.integers(len(_MORAE))]
            extra = random.random()
            word += "ン" if extra < 0.08 else "ー" if extra < 0.16 else "ッ" if extra < 0.2 and place < 3 else ""
        words.append(word.rstrip("ッ"))
    return "、".join(words) if random.random() < 0.3 else "".join(words)


def training_texts(random: np.random.Generator) -> Iterator[str]:
    """Endless: more than a third commands, less than a third each of everyday talk and of made-up words."""
    while True:
        kind = random.random()
        yield command(random) if kind < 0.42 else TRAIN.sentence(random) if kind < 0.7 else made_up(random)

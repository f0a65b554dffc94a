"""The studio's avatar on disk: reading, writing, and detection of changes by others."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.formats.usd import save_usd
from vistel.whole_file import whole_file
from vistel.wrinkle.sets_text import sets_text
from vistel.wrinkle.wrinkle_sets import WrinkleSet, sets_in, wrinkle_sets


class ConflictError(Exception):
    """The file has changed since the page read it."""


@dataclass(eq=False)
class Opened:
    """avatar: from the file, or built-in; path: where it is saved; source: the user's name for it."""

    avatar: Avatar
    path: Path
    source: str
    sets: list[WrinkleSet]

    @property
    def readable(self) -> Path:
        """The file of sets that is written beside the avatar, for people to read."""
        return self.path.with_name(f"{self.path.stem}_wrinkles.toml")

    def revision(self) -> str:
        """Revision of the file on disk; "" when there is none yet. Raises OSError."""
        try:
            return hashlib.sha256(self.path.read_bytes()).hexdigest()[:16]
        except FileNotFoundError:
            return ""

    def save(self, avatar: Avatar, sets: Sequence[WrinkleSet], revision: str) -> str:
        """Writes the avatar with its sets, and the readable file. Returns the new revision. Raises ConflictError when the file
        on disk is not of `revision`; WrinkleError; OSError."""
        if self.revision() != revision:
            raise ConflictError(f"{self.path.name} was saved by somebody else after this page read it")
        text = sets_text(sets)
        made = replace(avatar, wrinkles=text)
        save_usd(made, self.path)
        _write(self.readable, text)
        self.avatar, self.sets = made, list(sets)
        return self.revision()


def worn_by(avatar: Avatar, source: str) -> list[WrinkleSet]:
    """The sets of an avatar: those of its file, else the built-in ones. Raises WrinkleError."""
    return sets_in(avatar.wrinkles, source) if avatar.wrinkles else wrinkle_sets()


def _write(path: Path, text: str) -> None:
    with whole_file(path) as stream:
        stream.write(text.encode())

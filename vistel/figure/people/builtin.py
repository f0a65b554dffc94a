"""Built-in people by specification, kept in the user's cache directory."""

from __future__ import annotations

import hashlib
import logging
from dataclasses import replace
from pathlib import Path

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.cache_folder import default_cache, file_lock
from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.formats.avatar_file import load_avatar, save_avatar
from vistel.figure.people.person import VERSION, make_person
from vistel.figure.people.recipe import Recipe, parse_spec

_log = logging.getLogger(__name__)

WRINKLES = ("shirt", "trousers", "face", "hands")
"""Names of the sets of wrinkles (vistel/wrinkle/sets) that built-in people wear."""


def builtin_avatar(spec: str, *, name: str, height: float, cache: Path | None = None) -> Avatar:
    """The built-in person of `spec`: "builtin" (made from the name), "builtin:seed=3", "builtin:seed=3,build=1.1".

    height in metres (0.5 to 2.6). The first call makes the person (some seconds), later ones read it from `cache`
    (default: the user's cache directory); a cache that is damaged or cannot be written costs one log line.
    Raises ValueError naming what is wrong in the spec or the height.
    """
    recipe, path = _place(spec, name, height, cache)
    try:
        return replace(load_avatar(path), name=name)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except (AvatarFileError, OSError) as fault:
        _log.warning("event=avatar_cache_unreadable path=%s reason=%s action=make_again", path, fault)
    return _made(recipe, path, name=name, height=height)


def is_made(spec: str, *, name: str, height: float, cache: Path | None = None) -> bool:
    """Whether `builtin_avatar` would read this person instead of making it. Raises ValueError as it does."""
    return _place(spec, name, height, cache)[1].is_file()


def _place(spec: str, name: str, height: float, cache: Path | None) -> tuple[Recipe, Path]:
    """What a person is made of, and the file that keeps it."""
    recipe = parse_spec(spec, name)
    if not 0.5 <= height <= 2.6:
        raise ValueError(f"height: expected 0.5 to 2.6 m, got {height}")
    key = hashlib.sha256(repr((VERSION, recipe, round(height, 4))).encode()).hexdigest()[:20]
    return recipe, (cache if cache is not None else default_cache()) / f"person-{key}.npz"


def _made(recipe: Recipe, path: Path, *, name: str, height: float) -> Avatar:
    with file_lock(path.with_suffix(".lock")):
        # Another process may have made the same person while this one waited.
        try:
            return replace(load_avatar(path), name=name)
        except (AvatarFileError, OSError):
            pass
        avatar = make_person(recipe, name=name, height=height)
        try:
            save_avatar(avatar, path)
        except OSError as fault:
            _log.warning("event=avatar_cache_unwritable path=%s reason=%s", path, fault)
    return avatar

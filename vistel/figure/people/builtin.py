"""Built-in people by specification (`vistel.figure.people.measured`), kept in the user's cache directory."""

from __future__ import annotations

import hashlib
import logging
from dataclasses import replace
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.cache_folder import default_cache, file_lock
from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.body_model import person as body_model
from vistel.figure.body_model.person import Person
from vistel.figure.formats.avatar_file import load_avatar, save_avatar
from vistel.figure.people.measured import measured
from vistel.undisturbed import undisturbed
from vistel.whole_file import whole_file

_log = logging.getLogger(__name__)

_VERSION = 55
"""Of what is made of a specification; a change of it makes cached people void."""
_NUMBERS = ("rest", "tip", "a", "b", "radius_a", "radius_b")
WRINKLES = ("shirt", "trousers", "face", "hands")
"""Names of the sets of wrinkles (vistel/wrinkle/sets) that built-in people wear."""


def builtin_avatar(spec: str, *, name: str, height: float, cache: Path | None = None) -> Avatar:
    """The built-in person of `spec`: "builtin" (made from the name), "builtin:person=ben", "builtin:sex=male,age=40".

    height in metres (0.5 to 2.6). The first call makes the person (some seconds), later ones read it from `cache`
    (default: the user's cache directory); a cache that is damaged or cannot be written costs one log line.
    Raises ValueError naming what is wrong in the spec or the height.
    """
    who, path = _place(spec, name, height, cache)
    try:
        return replace(load_avatar(path), name=name)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except (AvatarFileError, OSError) as fault:
        _log.warning("event=avatar_cache_unreadable path=%s reason=%s action=make_again", path, fault)
    return _made(who, path, name)


@undisturbed
def builtin_proportions(spec: str, *, name: str, height: float, cache: Path | None = None) -> Proportions:
    """Joint chain and primitives of the avatar that `builtin_avatar` gives, sooner. Raises ValueError as it does."""
    who, path = _place(spec, name, height, cache)
    place = _limbs_beside(path)
    try:
        with np.load(place, allow_pickle=False) as kept:
            return Proportions.from_arrays(kept["names"].tolist(), kept["joint"].tolist(), *(kept[n] for n in _NUMBERS))
    except (FileNotFoundError, NotADirectoryError):
        pass
    except (OSError, ValueError, KeyError, EOFError, BadZipFile) as fault:
        _log.warning("event=limbs_cache_unreadable path=%s reason=%s action=make_again", place, fault)
    limbs = Proportions.of(*body_model.limbs_of(who))
    try:
        _keep_limbs(limbs, place)
    except OSError as fault:
        _log.warning("event=limbs_cache_unwritable path=%s reason=%s", place, fault)
    return limbs


def described(spec: str, name: str, height: float) -> Person:
    """What a specification says. Raises ValueError naming what is wrong in it or in the height."""
    if not 0.5 <= height <= 2.6:
        raise ValueError(f"height: expected 0.5 to 2.6 m, got {height}")
    return measured(spec, name, height)


def is_made(spec: str, *, name: str, height: float, cache: Path | None = None) -> bool:
    """Whether `builtin_avatar` would read this person instead of making it. Raises ValueError as it does."""
    return _place(spec, name, height, cache)[1].is_file()


def builtin_file(spec: str, *, name: str, height: float, cache: Path | None = None) -> Path:
    """The file that keeps the avatar that `builtin_avatar` gives, whether it is there or not. Raises ValueError as it does."""
    return _place(spec, name, height, cache)[1]


def _place(spec: str, name: str, height: float, cache: Path | None) -> tuple[Person, Path]:
    """What a person is made of, and the file that keeps it."""
    # Heights of other sites come as float32.
    who = described(spec, name, round(height, 4))
    key = hashlib.sha256(repr((_VERSION, who)).encode()).hexdigest()[:20]
    return who, (cache if cache is not None else default_cache()) / f"person-{key}.npz"


def _limbs_beside(path: Path) -> Path:
    return path.with_name(path.name.replace("person-", "limbs-"))


def _keep_limbs(limbs: Proportions, place: Path) -> None:
    """Raises OSError."""
    place.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(place) as file:
        np.savez(file, names=limbs.names, joint=limbs.joint, **dict(zip(_NUMBERS, limbs.arrays, strict=True)))


def _made(who: Person, path: Path, name: str) -> Avatar:
    with file_lock(path.with_suffix(".lock")):
        # Another process may have made the same person while this one waited.
        try:
            return replace(load_avatar(path), name=name)
        except (AvatarFileError, OSError):
            pass
        avatar = body_model.make(who, name)
        try:
            save_avatar(avatar, path)
            # Kept, too, so that who only asks for its limbs need not fit it again.
            _keep_limbs(Proportions.of(avatar.skeleton, avatar.body), _limbs_beside(path))
        except OSError as fault:
            _log.warning("event=avatar_cache_unwritable path=%s reason=%s", path, fault)
    return avatar

"""Figures kept on disk, ready to deform: making one takes two seconds of computing, reading it back some hundredths.

They lie in the user's own cache folder, as compiled kernels do, under a name that is a digest of the avatar and of all code that
makes a figure of it. A file holds no code (`object_file`), but its numbers are believed: kernels take indices, and where arrays
lie, from them without a look. So it is read only as this user's processes wrote it, under that name (`seal`).
"""

import contextlib
import hashlib
import inspect
import logging
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from vistel.figure import figure
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.cache_folder import default_cache, file_lock
from vistel.figure.layers import skin
from vistel.jit.kernel_jit import stamp_of
from vistel.render.figures import figures
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.object_file import ObjectFileError, from_bytes, to_bytes
from vistel.render.figures.seal import own_key, seal, unsealed
from vistel.whole_file import whole_file
from vistel.wrinkle import shown
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.wrinkle_sets import FOLDER, WrinkleSet, sets_in, wrinkle_sets

log = logging.getLogger("vistel.renderer")

KEPT = ".figure"
"""The ending of files with figures."""
_LAYOUT = "sealed 1"
"""Of such a file: another one has other names."""
MOST_KEPT = 1 << 30
"""Bytes of figures kept; those not used for longest go first."""


def cached_figure(avatar: Avatar, cache: Path | None = None, wears: Sequence[str] = ()) -> AvatarFigure:
    """The figure of an avatar: read back if it was made before, else made and kept. wears: names of built-in wrinkles;
    without, those that the avatar's file says, and none with a line in the log where that cannot be read.

    Processes of a machine that want the same one take turns. A folder that cannot be used costs only the keeping.
    """
    return _kept(_digest(avatar, wears, wrinkled=bool(wears or avatar.wrinkles)), lambda: _made(avatar, wears), cache)


def figure_of_file(
    file: Path, name: str, read: Callable[[], Avatar], cache: Path | None = None, wears: Sequence[str] = ()
) -> AvatarFigure:
    """As `cached_figure`, of the avatar called `name` that `read` reads from `file`, or makes and writes there. Where a figure is
    kept that was made of the file as it is, which its size and time of change tell, it is not read."""
    avatar = None if file.is_file() else read()
    try:
        now = file.stat()
    except OSError:  # it cannot be written
        return cached_figure(avatar or read(), cache, wears)
    digest = _digest((file.name, now.st_size, now.st_mtime_ns, name), wears, wrinkled=True)
    return _kept(digest, lambda: _made(avatar or read(), wears), cache)


def _kept(digest: str, make: Callable[[], AvatarFigure], cache: Path | None) -> AvatarFigure:
    folder = default_cache().parent / "figures" if cache is None else cache
    path = folder / f"{digest}{KEPT}"
    if (key := own_key()) is None:
        return make()
    if (kept := _read(path, key)) is not None:
        return kept
    with file_lock(path.with_suffix(".lock")):
        if (kept := _read(path, key)) is not None:
            return kept
        person = make()
        _write(path, key, person)
    return person


def _made(avatar: Avatar, wears: Sequence[str]) -> AvatarFigure:
    return AvatarFigure(avatar, wears=wrinkle_sets(wears) if wears else _own_wrinkles(avatar))


def _own_wrinkles(avatar: Avatar) -> list[WrinkleSet]:
    if not avatar.wrinkles:
        return []
    try:
        return sets_in(avatar.wrinkles, f"avatar {avatar.name!r}: wrinkles")
    except WrinkleError as fault:
        log.warning("event=wrinkles_refused reason=%r action=none_worn", str(fault).splitlines()[0])
        return []


def _digest(made_of: object, wears: Sequence[str], *, wrinkled: bool) -> str:
    made_by = f"{_LAYOUT} {sys.version} {np.__version__} {_CODE}"
    if wrinkled:
        files = sorted(FOLDER.parent.rglob("*.toml"))
        made_by += " ".join(wears) + "".join(f.read_text("utf-8") for f in files)
    digest = hashlib.blake2b(made_by.encode(), digest_size=16)
    _take(digest, made_of)
    return digest.hexdigest()


def _take(digest: hashlib.blake2b, value: object) -> None:
    """What a value says, however it is laid out and whatever it has worked out meanwhile (its file holds both): an avatar
    that was just made, one that was read and one that a figure was made of have one digest."""
    if isinstance(value, np.ndarray):
        array = np.ascontiguousarray(cast("NDArray[Any]", value))
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(array.data)
    elif is_dataclass(value):
        for field in fields(value):
            _take(digest, getattr(value, field.name))
    elif isinstance(value, tuple):
        parts = cast("tuple[object, ...]", value)
        digest.update(f"{len(parts)}:".encode())
        for each in parts:
            _take(digest, each)
    else:
        digest.update(repr(value).encode())


_CODE = " ".join(
    stamp_of(Path(inspect.getfile(module)), Path(inspect.getfile(module)).parents[depth])
    for module, depth in ((figures, 3), (figure, 2), (skin, 3), (shown, 2))
)
"""The state of the code that figures are made by."""


def _read(path: Path, key: bytes) -> AvatarFigure | None:
    """None where there is none. What is no good is removed, with a line in the log."""
    try:
        with path.open("rb") as file:
            found = os.fstat(file.fileno())
            others = hasattr(os, "getuid") and (found.st_uid != os.getuid() or found.st_mode & 0o022)
            data = np.fromfile(file, np.uint8)
        os.utime(path)
    except OSError:
        return None
    fault = "others may have written it" if others else "not as this user wrote it"
    if not others and (body := unsealed(key, path.stem, data)) is not None:
        try:
            person = from_bytes(body)
        except ObjectFileError as e:
            fault = str(e)
        else:
            return person if isinstance(person, AvatarFigure) else None
    log.warning("event=figure_damaged path=%s reason=%r action=made_again", path, fault)
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)
    return None


def _write(path: Path, key: bytes, person: AvatarFigure) -> None:
    """Whole or not at all; older ones make room."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        pieces = to_bytes(person)
        with whole_file(path, private=True) as stream:
            stream.writelines(pieces)
            stream.write(seal(key, path.stem, pieces))
        _make_room(path.parent)
    except OSError as fault:
        log.warning("event=figure_not_kept path=%s reason=%s", path, fault)


def _make_room(folder: Path) -> None:
    for earlier in folder.glob("*.pickle"):  # of versions that kept figures as such
        earlier.unlink(missing_ok=True)
    files = sorted(folder.glob(f"*{KEPT}"), key=lambda f: f.stat().st_mtime, reverse=True)
    total = 0
    for file in files:
        total += file.stat().st_size
        if total > MOST_KEPT:
            file.unlink(missing_ok=True)
            file.with_suffix(".lock").unlink(missing_ok=True)

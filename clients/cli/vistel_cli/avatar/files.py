"""Reading, writing and reporting avatars, for the commands of `vistel avatar`."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vistel_cli.terminal import FAILED, USAGE, fail, out
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from vistel.figure.avatar.avatar import Avatar

Json = Annotated[bool, typer.Option("--json", help="Report as one JSON object.")]


def busy(what: str | Callable[[], str], show: bool) -> AbstractContextManager[None]:
    """Within the block, `what` runs now, or what it gives then: said as soon as it takes long."""
    return waiting(what) if show else nullcontext()


def load(file: Path) -> Avatar:
    """The avatar in a file. Ends the command with one line when there is none."""
    with busy(f"reading {file.name}", True):
        from vistel.figure.avatar.check import AvatarFileError
        from vistel.figure.formats.load import load_any

        try:
            return load_any(file)
        except AvatarFileError as fault:
            fail(str(fault))
        except OSError as fault:
            fail(f"{file}: cannot be read: {fault.strerror or fault}")


def load_or_make(spec: str, name: str = "", height: float = 1.75) -> Avatar:
    """The avatar in a file, or the built-in one that "builtin:…" describes. Ends the command with one line when there is none.
    name: of a built-in one; default: that of the person in the description."""
    if not spec.startswith("builtin"):
        return load(Path(spec))
    with busy("making the person", True):
        from vistel.figure.people.builtin import builtin_avatar

        try:
            named = re.search(r"\bperson=(\w+)", spec)
            return builtin_avatar(spec, name=name or (named[1] if named else "somebody"), height=height)
        except ValueError as fault:
            fail(str(fault), USAGE)


def own(file: Path) -> Avatar | None:
    """The avatar of a file that VISTEL wrote; None for any other file."""
    from vistel.figure.avatar.check import AvatarFileError
    from vistel.figure.formats.load import load_any

    if file.suffix.lower() in (".npz", ".obj"):
        return None
    try:
        return load_any(file)
    except (AvatarFileError, OSError):
        return None


def check_output(output: Path) -> None:
    """Ends the command with one line when no avatar can be written there."""
    from vistel.figure.making.source import USD_ENDINGS

    if output.suffix.lower() not in USD_ENDINGS:
        fail(f"{output}: expected a name that ends in {', '.join(USD_ENDINGS)}")


def save(avatar: Avatar, output: Path, show: bool) -> None:
    """Writes the avatar as USD. Ends the command with one line when that fails."""
    from vistel.figure.formats.usd import save_usd

    try:
        with busy(f"writing {output.name}", show):
            save_usd(avatar, output)
    except OSError as fault:
        fail(f"{output}: cannot be written: {fault.strerror or fault}", FAILED)


def facts(avatar: Avatar) -> dict[str, Any]:
    """The figures of an avatar: its meshes, joints and textures."""
    return {
        "name": avatar.name,
        "height_m": round(avatar.skeleton.height, 3),
        "vertices": len(avatar.mesh.vertices),
        "triangles": len(avatar.mesh.triangles),
        "eyeballs": len(avatar.eyeballs),
        "levels": 1 + len(avatar.coarser),
        "primitives": len(avatar.body),
    }


def report(as_json: bool, facts: dict[str, Any]) -> None:
    """The facts as one JSON object or as a table."""
    if as_json:
        print(json.dumps(facts))
        return
    for key, value in facts.items():
        parts = [f"{name}: {what}" for name, what in value.items()] if isinstance(value, dict) else value
        text = (", ".join(map(str, parts)) or "none") if isinstance(parts, list | tuple) else parts
        out.print(f"{key.replace('_', ' '):26} {text}", soft_wrap=True)

"""`vistel testing init`: begins a package with a driver, its simulator and its tests."""

from __future__ import annotations

import importlib.util
import keyword
import re
import shlex
from pathlib import Path
from typing import Annotated

import typer

from vistel.devices.builtin import KINDS
from vistel_cli.terminal import USAGE, fail, out

TEMPLATE = Path(__file__).parents[1] / "examples/files/12_write_a_device_driver"
"""The example of a driver: what it is called is replaced."""
CALLED = "beacon"
ELSEWHERE = {"ci.yml": ".github/workflows/tests.yml"}
"""Where files of the template go that cannot stand there in the repository."""
SKIPPED = re.compile(r"__pycache__|\.egg-info|\.pyc$|build/")


def init(
    folder: Annotated[
        Path, typer.Argument(help="Folder to write the package to; its last name is the device's. Made if it is missing.")
    ],
) -> None:
    """Begin a package: a driver of a device of yours with its simulator, its tests with the kit, and a file for CI.

    Nothing is written over. The device of the template is an invented tracker that sends lines of text.

    [bold]Example[/bold]

      vistel testing init my-tracker
    """
    name = re.sub(r"\W+", "_", folder.resolve().name).strip("_").lower()
    if not name.isidentifier() or keyword.iskeyword(name):
        fail(f"{folder}: expected a folder whose name can be a package's, such as my-tracker; got {name!r}", USAGE)
    if name != CALLED and importlib.util.find_spec(name) is not None:
        fail(f"{folder}: a package {name!r} is installed already; choose another name", USAGE)
    if any(kind.name == name for kind in KINDS):
        fail(f"{folder}: VISTEL has a device {name!r} of its own; choose another name", USAGE)
    files = {_renamed(ELSEWHERE.get(str(path), str(path)), name): _renamed(text, name) for path, text in _template().items()}
    try:
        there = [file for file in files if (folder / file).exists()]
        if there:
            more = f" (and {len(there) - 1} more)" if len(there) > 1 else ""
            fail(f"{folder / there[0]}{more}: exists already; nothing was written: name another folder")
        for file, text in files.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            with (folder / file).open("x", encoding="utf-8") as stream:
                stream.write(text)
    except OSError as e:
        fail(f"{e.filename or folder}: cannot be written: {e.strerror}")
    for file in files:
        out.print(str(folder / file), soft_wrap=True)
    out.print(f'next: cd {shlex.quote(str(folder))}; python -m pip install -e ".[test]"; python -m pytest', soft_wrap=True)


def _template() -> dict[str, str]:
    """The files of the example by their paths in it."""
    paths = [p.relative_to(TEMPLATE).as_posix() for p in sorted(TEMPLATE.rglob("*")) if p.is_file()]
    return {path: (TEMPLATE / path).read_text("utf-8") for path in paths if not SKIPPED.search(path)}


def _renamed(text: str, name: str) -> str:
    title = "".join(word.capitalize() for word in name.split("_"))
    return text.replace(CALLED, name).replace(CALLED.capitalize(), title)

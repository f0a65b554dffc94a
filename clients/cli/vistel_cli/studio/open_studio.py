"""`vistel studio` and `vistel wrinkle studio`: pages to look at an avatar, draw wrinkles on it, and calibrate devices."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vistel_cli.avatar.files import check_output, load_or_make
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE, GLTF, USD, WRINKLES
from vistel_cli.overwriting import Force, out_file
from vistel_cli.studio.serve import serve
from vistel_cli.terminal import fail, load_conference
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from aiohttp.web import Application

    from vistel_cli.studio.wrinkles.opened import Opened

AvatarArgument = Annotated[str, Takes(USD, GLTF, names=True), typer.Argument(help='An avatar file (USD), or "builtin:…".')]
Output = Annotated[Path | None, out_file("Where to save; default: the file itself.")]
Port = Annotated[
    int | None, typer.Option(min=0, max=65535, help="Port; 0: any free port; default: 8765, or any free port where that is taken.")
]
Host = Annotated[str, typer.Option(help="Address to listen at. Everybody who can reach it can edit the files.")]
OpenPage = Annotated[bool, typer.Option("--open", help="Open the page in a browser.")]


def studio(
    avatar: AvatarArgument = "builtin",
    conference_file: Annotated[
        Path | None,
        Takes(CONFERENCE),
        typer.Option("--conference", help="Conference file, with the devices that are to be calibrated."),
    ] = None,
    output: Output = None,
    port: Port = None,
    host: Host = "127.0.0.1",
    open_page: OpenPage = False,
    force: Force = False,
) -> None:
    """Look at an avatar in any posture, draw wrinkles on it, and calibrate devices, on pages in the browser.

    [bold]Examples[/bold]

      vistel studio me.usda --open

      vistel studio me.usda --conference conference.toml
    """
    opened = _opened(avatar, output, None)
    _serve(opened, "avatar", host, port, open_page, conference_file)


def wrinkle_studio(
    avatar: AvatarArgument = "builtin",
    output: Output = None,
    sets: Annotated[
        Path | None, Takes(WRINKLES), typer.Option(help="File of sets to begin with, instead of the avatar's own.")
    ] = None,
    port: Port = None,
    host: Host = "127.0.0.1",
    open_page: OpenPage = False,
    force: Force = False,
) -> None:
    """Draw and edit wrinkles on a page in the browser, and see them on the figure at once. Saves into the avatar's USD.

    [bold]Examples[/bold]

      vistel wrinkle studio me.usda --open

      vistel wrinkle studio builtin:person=carla -o eva.usda --port 9000
    """
    _serve(_opened(avatar, output, sets), "wrinkles", host, port, open_page, None)


def _serve(opened: Opened, first: str, host: str, port: int | None, show: bool, conference: Path | None) -> None:
    loaded = load_conference(conference) if conference is not None else None

    def parts() -> Mapping[str, Application]:
        from vistel_cli.studio.avatar import AvatarStudio
        from vistel_cli.studio.calibration import CalibrationStudio
        from vistel_cli.studio.wrinkles.server import WrinkleStudio

        return {
            "avatar": AvatarStudio(lambda: opened.avatar, opened.source).app(),
            "wrinkles": WrinkleStudio(opened).app(),
            "calibration": CalibrationStudio(loaded, conference).app(),
        }

    serve(parts, first, host, port, show, f"wrinkles are saved to {opened.path}")


def _opened(spec: str, output: Path | None, sets: Path | None) -> Opened:
    """A built-in person is saved to a name that is free, unless one is given."""
    with waiting("loading the studio"):
        from vistel.wrinkle.errors import WrinkleError  # - the mathematics take long to load
        from vistel.wrinkle.wrinkle_sets import load_sets
        from vistel_cli.studio.wrinkles.opened import Opened, worn_by

    made = spec.startswith("builtin")
    path = output or (_free_name() if made else Path(spec))
    if path.suffix.lower() == ".npz" or not path.suffix:
        fail(f"{path}: cannot be saved to; name a file with -o NAME.usda")
    check_output(path)
    if made and path.exists():
        fail(f"{path}: exists already; open it, or name another with -o")
    found = load_or_make(spec, path.stem)
    try:
        return Opened(found, path, spec, load_sets(sets) if sets else worn_by(found, spec))
    except WrinkleError as fault:
        fail(str(fault))


def _free_name() -> Path:
    names = (Path(f"avatar{f'-{n}' if n > 1 else ''}.usda") for n in count(1))
    return next(name for name in names if not name.exists())

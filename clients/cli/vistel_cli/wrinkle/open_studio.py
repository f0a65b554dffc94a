"""`vistel wrinkle studio`: opens a page to draw wrinkles on a figure."""

from __future__ import annotations

import asyncio
import errno
import logging
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vistel_cli.avatar.files import check_output, load_or_make
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import GLTF, USD, WRINKLES
from vistel_cli.overwriting import Force, out_file
from vistel_cli.stop_asked import stop_asked
from vistel_cli.terminal import FAILED, fail, out
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from vistel_cli.wrinkle.studio.opened import Opened

PORT = 8765
"""Where the studio is found unless another port is named or this one is taken."""


def studio(
    avatar: Annotated[str, Takes(USD, GLTF, names=True), typer.Argument(help='An avatar file (USD), or "builtin:…".')] = "builtin",
    output: Annotated[Path | None, out_file("Where to save; default: the file itself.")] = None,
    sets: Annotated[
        Path | None, Takes(WRINKLES), typer.Option(help="File of sets to begin with, instead of the avatar's own.")
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="Port; 0: any free port; default: 8765, or any free port where that is taken."),
    ] = None,
    host: Annotated[str, typer.Option(help="Address to listen at. Everybody who can reach it can edit the avatar.")] = "127.0.0.1",
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
    force: Force = False,
) -> None:
    """Draw and edit wrinkles on a page in the browser, and see them on the figure at once. Saves into the avatar's USD.

    [bold]Examples[/bold]

      vistel wrinkle studio me.usda --open

      vistel wrinkle studio builtin:person=carla -o eva.usda --port 9000
    """
    opened = _opened(avatar, output, sets)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(message)s")
    logging.getLogger("aiohttp.access").setLevel(logging.WARNING)
    try:
        asyncio.run(_serve(opened, host, port, open_page))
    except OSError as fault:
        fail(
            f"port {PORT if port is None else port} at {host} cannot be opened: {fault.strerror or fault}; choose another --port",
            FAILED,
        )


def _opened(spec: str, output: Path | None, sets: Path | None) -> Opened:
    with waiting("loading the studio"):
        from vistel.wrinkle.errors import WrinkleError  # - the mathematics take long to load
        from vistel.wrinkle.wrinkle_sets import load_sets
        from vistel_cli.wrinkle.studio.opened import Opened, worn_by

    made = spec.startswith("builtin")
    path = output or Path("avatar.usda" if made else spec)
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


async def _serve(opened: Opened, host: str, port: int | None, show: bool) -> None:
    from aiohttp import web

    from vistel_cli.wrinkle.studio.server import Studio

    studio = Studio(opened)
    hosts: set[str] = set()
    runner = web.AppRunner(studio.app(hosts), handle_signals=False, shutdown_timeout=1.0)
    await runner.setup()
    stop = stop_asked()
    try:
        try:
            await web.TCPSite(runner, host, PORT if port is None else port).start()
        except OSError as fault:
            if port is not None or fault.errno != errno.EADDRINUSE:
                raise
            await web.TCPSite(runner, host, 0).start()
        actual = int(runner.addresses[0][1])
        hosts |= {f"{name}:{actual}" for name in {host, "localhost", "127.0.0.1"}}
        address = f"http://{'localhost' if host in ('0.0.0.0', '::') else host}:{actual}/"
        out.print(f"studio at {address} (Ctrl-C ends it); saves to {opened.path}", soft_wrap=True)
        if show:
            webbrowser.open(address)
        await stop.wait()
    finally:
        await runner.cleanup()

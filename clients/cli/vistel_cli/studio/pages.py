"""The frame round all studios: one server, one navigation, and the way back to the room of the conference that runs here."""

from collections.abc import Mapping, Set
from importlib.resources.abc import Traversable
from pathlib import Path, PurePath

from aiohttp import web

from vistel.conference.running import running_conferences
from vistel_cli.studio.requests import RequestError, guard
from vistel_services.console import bundle

MOST_BYTES = 64 << 20
"""Of a request: photographs come in one."""
PAGE = Path(__file__).with_name("page")
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}


def studios(parts: Mapping[str, web.Application], hosts: Set[str], first: str) -> web.Application:
    """parts: each studio by its name in addresses; hosts: as of `guard`; first: the one that the plain address leads to."""

    async def whole(_: web.Request) -> web.StreamResponse:
        raise web.HTTPFound(f"/{first}/")

    async def which(_: web.Request) -> web.StreamResponse:
        console = next((r.console for r in running_conferences() if r.console), "")
        return web.json_response({"studios": list(parts), "console": console})

    app = web.Application(middlewares=[guard(hosts)], client_max_size=MOST_BYTES)
    app.router.add_get("/", whole)
    app.router.add_get("/studios.json", which)
    add_files(app, PAGE, {"/frame.css": "frame.css"})
    # They look as the console does, and say as it does what has not been made.
    add_files(app, bundle.FOLDER, {"/console.css": "console.css", "/missing.js": "missing.js"})
    for name, part in parts.items():
        app.add_subapp(f"/{name}/", part)
    return app


def add_files(app: web.Application, folder: Traversable, files: Mapping[str, str]) -> None:
    """Serve files of a folder, by path."""

    def serve(at: str, path: Traversable) -> None:
        async def file(_: web.Request) -> web.StreamResponse:
            try:
                data = path.read_bytes()
            except FileNotFoundError as fault:
                raise RequestError(f"{path.name} has not been made; `make web` makes it", 404) from fault
            return web.Response(body=data, content_type=_TYPES[PurePath(path.name).suffix], charset="utf-8")

        app.router.add_get(at, file)

    for at, name in files.items():
        serve(at, folder / name)

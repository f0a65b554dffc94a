"""The wrinkle studio's part of the server: its page, and the mathematics behind it."""

import asyncio
import io
import logging
import secrets
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from aiohttp import web
from PIL import Image

from vistel.wrinkle.shape_file import builtin_shapes
from vistel.wrinkle.wrinkle_sets import WrinkleSet
from vistel_cli.studio.pages import add_files
from vistel_cli.studio.requests import RequestError, read_json
from vistel_cli.studio.wrinkles.bends import BENDS, driving_actions, driving_joints
from vistel_cli.studio.wrinkles.document import check, page_form
from vistel_cli.studio.wrinkles.envelope import packed
from vistel_cli.studio.wrinkles.figure_scene import FigureScene
from vistel_cli.studio.wrinkles.opened import ConflictError, Opened
from vistel_cli.studio.wrinkles.photograph import texture_of
from vistel_cli.studio.wrinkles.session import PageSession

log = logging.getLogger("vistel.studio")
T = TypeVar("T")

PAGE = Path(__file__).with_name("page")
_FILES = {"/": "index.html", "/studio.css": "studio.css", "/studio.js": "studio.js"}
MOST_PAGES = 8
"""Most sessions at once. The one longest unused is dropped; its page must be opened again."""


class WrinkleStudio:
    """Serves one avatar to any number of pages."""

    def __init__(self, opened: Opened) -> None:
        self._opened = opened
        self._sessions: OrderedDict[str, PageSession] = OrderedDict()
        self._scene: FigureScene | None = None
        self._laid: tuple[FigureScene, list[WrinkleSet], PageSession] | None = None
        self._doing: dict[str, str] = {}
        self._maths = ThreadPoolExecutor(1, thread_name_prefix="studio")

    def app(self) -> web.Application:
        """Its part of the studios' server."""
        app = web.Application()
        add_files(app, PAGE, _FILES)
        app.router.add_post("/api/open", self._open)
        app.router.add_post("/api/update", self._update)
        app.router.add_post("/api/save", self._save)
        app.router.add_post("/api/photograph", self._photograph)
        app.router.add_post("/api/picture", self._picture)
        app.router.add_get("/api/albedo", self._albedo)
        app.router.add_get("/api/doing", self._now)
        app.on_cleanup.append(self._close)
        return app

    async def _close(self, _: web.Application) -> None:
        self._maths.shutdown(wait=False, cancel_futures=True)

    async def _open(self, request: web.Request) -> web.StreamResponse:
        """A page begins: {page: a name of its own choice for `doing`}."""
        page = str((await read_json(request)).get("page", ""))

        def opened() -> tuple[dict[str, Any], dict[str, Any]]:
            say = self._say(page)
            if self._scene is None:
                self._scene = FigureScene(self._opened.avatar, say)
            scene, revision = self._scene, self._opened.revision()
            form = page_form(self._opened.sets)
            if self._laid is None or self._laid[0] is not scene or self._laid[1] is not self._opened.sets:
                first = PageSession(scene, check(form), scene.bare, say)
                first.lay()
                self._laid = scene, self._opened.sets, first
            first = self._laid[2]
            session = PageSession(scene, first.checked, first.worn, say, left_out=first.left_out)
            key = secrets.token_urlsafe(12)
            self._sessions[key] = session
            while len(self._sessions) > MOST_PAGES:
                self._sessions.popitem(last=False)
            mesh = {"triangles": scene.triangles, "uv": scene.uv}
            return {
                "session": key,
                "revision": revision,
                "name": scene.avatar.name,
                "source": self._opened.source,
                "saves": self._opened.path.name,
                "readable": self._opened.readable.name,
                "form": {**form, "texture": texture_of(scene.avatar), "pins": [], "base": 0},
                "height": round(scene.avatar.skeleton.height, 3),
                "regions": session.regions(),
                "shapes": {name: shape.model_dump(mode="json") for name, shape in builtin_shapes().items()},
                "bends": [_of(bend, "name", "label", "group", "low", "high", "start", "unit", "action") for bend in BENDS],
                "joints": driving_joints(),
                "actions": driving_actions(),
                "albedo": [scene.albedo.shape[1], scene.albedo.shape[0]],
            }, mesh

        head, arrays = await self._do(page, opened)
        log.info("event=page_opened session=%s pages=%d", head["session"], len(self._sessions))
        return _packed(head, arrays)

    async def _update(self, request: web.Request) -> web.StreamResponse:
        asked = await read_json(request)
        session = self._session(asked)
        head, arrays = await self._do(str(asked.get("page", "")), lambda: session.update(asked))
        return _packed(head, arrays)

    async def _photograph(self, request: web.Request) -> web.StreamResponse:
        asked = await read_json(request)
        session = self._session(asked)
        return _packed(*await self._do(str(asked.get("page", "")), lambda: session.photograph(asked)))

    async def _picture(self, request: web.Request) -> web.StreamResponse:
        """A photograph as it is, for ?island= of the session's avatar."""
        session, data = self._session(request.query), await request.read()
        try:
            island = int(request.query.get("island", ""))
        except ValueError as fault:
            raise RequestError("island: expected a number") from fault
        return web.json_response(await self._do(request.query.get("page", ""), lambda: session.bring(island, data)))

    async def _save(self, request: web.Request) -> web.StreamResponse:
        """{session, revision, form}: 409 where the file is of another revision."""
        asked = await read_json(request)
        session = self._session(asked)

        def saved() -> str:
            session.say(f"writing {self._opened.path.name}")
            form = asked.get("form")
            form = form if isinstance(form, dict) else {}
            session.retexture(form)
            faults = session.wear(form) or session.left_out
            if faults:
                raise RequestError(faults[0].text)
            revision = self._opened.save(session.scene.avatar, session.checked.whole, str(asked.get("revision", "")))
            self._scene = session.scene
            return revision

        try:
            revision = await self._do(str(asked.get("page", "")), saved)
        except ConflictError as fault:
            raise RequestError(str(fault), 409) from fault
        log.info("event=saved path=%s", self._opened.path)
        return web.json_response({"revision": revision, "files": [self._opened.path.name, self._opened.readable.name]})

    async def _albedo(self, request: web.Request) -> web.StreamResponse:
        session = self._session(request.query)

        def png() -> bytes:
            plain = request.query.get("of") == "avatar"
            stream = io.BytesIO()
            Image.fromarray(session.texture(request.query) if plain else session.scene.albedo).save(stream, "png", compress_level=1)
            return stream.getvalue()

        return web.Response(body=await self._do("", png), content_type="image/png")

    async def _now(self, request: web.Request) -> web.StreamResponse:
        """Name of the step that runs for a page; "" when none runs."""
        return web.json_response({"doing": self._doing.get(request.query.get("page", ""), "")})

    def _say(self, page: str) -> Callable[[str], None]:
        def say(text: str) -> None:
            self._doing[page] = text

        return say

    async def _do(self, page: str, work: Callable[[], T]) -> T:
        """Runs the work in the one thread of the mathematics, after the work before it."""
        try:
            return await asyncio.get_running_loop().run_in_executor(self._maths, work)
        finally:
            self._doing.pop(page, None)

    def _session(self, asked: Any) -> PageSession:
        key = str(asked.get("session", ""))
        if key not in self._sessions:
            raise RequestError("this page's session has ended; open it again", 410)
        self._sessions.move_to_end(key)
        return self._sessions[key]


def _packed(head: dict[str, Any], arrays: dict[str, Any]) -> web.Response:
    return web.Response(body=packed(head, arrays), content_type="application/octet-stream")


def _of(what: object, *names: str) -> dict[str, Any]:
    return {name: getattr(what, name) for name in names}

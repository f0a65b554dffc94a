"""The avatar studio's part of the server: the figure's file, its postures, and whether it is sound."""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from aiohttp import web

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.formats.gltf import gltf_bytes
from vistel.figure.making.report import inspect_avatar, verdict
from vistel.figure.posture.posture import Posture, local_joints, pose_joints
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINTS
from vistel_cli.studio.pages import PAGE, add_files
from vistel_cli.studio.requests import RequestError, read_json
from vistel_cli.studio.wrinkles.bends import BENDS, posture_of, values_of

T = TypeVar("T")


class AvatarStudio:
    """Shows one avatar. avatar: as it is now, since wrinkles may be saved into it meanwhile; source: the user's name for it."""

    def __init__(self, avatar: Callable[[], Avatar], source: str) -> None:
        self._avatar, self._source = avatar, source
        self._postures = standard_postures()
        self._made: dict[str, tuple[Avatar, Any]] = {}
        self._maths = ThreadPoolExecutor(1, thread_name_prefix="avatar-studio")

    def app(self) -> web.Application:
        """Its part of the studios' server."""
        app = web.Application()
        add_files(app, PAGE, {"/": "avatar.html", "/avatar.css": "avatar.css", "/avatar.js": "avatar.js"})
        app.router.add_get("/about.json", self._about)
        app.router.add_get("/figure.glb", self._file)
        app.router.add_get("/verdict.json", self._verdict)
        app.router.add_post("/pose", self._pose)
        app.on_cleanup.append(self._close)
        return app

    async def _close(self, _: web.Application) -> None:
        self._maths.shutdown(wait=False, cancel_futures=True)

    async def _about(self, _: web.Request) -> web.StreamResponse:
        avatar = self._avatar()
        bends = [bend for bend in BENDS if not bend.action]  # of the face the page has every shape that the file holds
        return web.json_response(
            {
                "name": avatar.name,
                "source": self._source,
                "height": round(avatar.skeleton.height, 3),
                "joints": JOINTS,
                "postures": list(self._postures),
                "bends": [{k: getattr(b, k) for k in ("name", "label", "group", "low", "high", "start", "unit")} for b in bends],
            }
        )

    async def _file(self, _: web.Request) -> web.StreamResponse:
        return web.Response(body=await self._once("file", gltf_bytes), content_type="model/gltf-binary")

    async def _verdict(self, _: web.Request) -> web.StreamResponse:
        facts, fit = await self._once("verdict", inspect_avatar)
        return web.json_response({"lines": [line.strip() for line in verdict(facts)], "fit": fit.lines()})

    async def _pose(self, request: web.Request) -> web.StreamResponse:
        """{posture: the name of one} or {bends: values of sliders by name}: each joint in its parent's frame, the hips in the
        room's: positions (J, 3) [m] and quaternions (J, 4) x y z w."""
        asked = await read_json(request)
        posture, skeleton = self._posture(asked), self._avatar().skeleton
        position, rotation = await self._do(lambda: local_joints(pose_joints(skeleton, posture)))
        return web.json_response({"positions": position.round(5).tolist(), "rotations": rotation.round(6).tolist()})

    def _posture(self, asked: dict[str, Any]) -> Posture:
        bends = asked.get("bends")
        if isinstance(bends, dict):
            return posture_of(values_of(bends))
        name = asked.get("posture")
        if not isinstance(name, str) or name not in self._postures:
            raise RequestError(f"posture: expected one of {', '.join(self._postures)}")
        return self._postures[name]

    async def _once(self, what: str, make: Callable[[Avatar], T]) -> T:
        """What is made of the avatar, once for each avatar that it has been."""
        avatar = self._avatar()

        def made() -> T:
            if what not in self._made or self._made[what][0] is not avatar:
                self._made[what] = avatar, make(avatar)
            return self._made[what][1]

        return await self._do(made)

    async def _do(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._maths, work)

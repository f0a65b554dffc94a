"""The avatar studio's server: the figure's file, its postures as the library has them, and a verdict; what it refuses."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import numpy as np
import pytest
from aiohttp import web
from aiohttp.test_utils import TestClient, TestServer
from avatar_fixture import long_armed

from vistel.conference.running import Running, announced
from vistel.figure.formats.load import load_any
from vistel.figure.posture.posture import local_joints, pose_joints
from vistel.figure.posture.standard import standard_postures
from vistel_cli.studio.avatar import AvatarStudio
from vistel_cli.studio.pages import studios
from vistel_cli.studio.wrinkles.bends import posture_of, values_of

JSON = {"Content-Type": "application/json"}


async def served(ask) -> None:
    avatar, hosts = long_armed(), set[str]()
    app = studios({"avatar": AvatarStudio(lambda: avatar, "me.usda").app(), "other": web.Application()}, hosts, "avatar")
    async with TestClient(TestServer(app)) as client:
        hosts.add(f"{client.host}:{client.port}")
        await ask(client, avatar)


def test_the_figures_file_and_a_verdict_come(tmp_path: Path) -> None:
    async def ask(client: TestClient, avatar) -> None:
        answer = await client.get("/")
        assert answer.status == 200 and answer.url.path == "/avatar/"
        path = tmp_path / "figure.glb"
        path.write_bytes(await (await client.get("/avatar/figure.glb")).read())
        read = load_any(path)
        np.testing.assert_allclose(read.mesh.vertices, avatar.mesh.vertices, atol=1e-6)
        about = await (await client.get("/avatar/about.json")).json()
        assert (about["source"], about["height"]) == ("me.usda", pytest.approx(avatar.skeleton.height, abs=1e-3))
        said = await (await client.get("/avatar/verdict.json")).json()
        assert len(said["lines"]) == 3 and said["lines"][1].startswith("mesh")

    asyncio.run(served(ask))


def test_a_posture_by_name_or_by_sliders_is_the_librarys(tmp_path: Path) -> None:
    async def ask(client: TestClient, avatar) -> None:
        bends = {"left_elbow": 90, "knees": 1e9, "nobody": 3}
        for asked, posture in (
            ({"posture": "table"}, standard_postures()["table"]),
            ({"bends": bends}, posture_of(values_of(bends))),
        ):
            said = await (await client.post("/avatar/pose", json=asked)).json()
            position, rotation = local_joints(pose_joints(avatar.skeleton, posture))
            np.testing.assert_allclose(said["positions"], position, atol=1e-5)
            np.testing.assert_allclose(said["rotations"], rotation, atol=1e-6)

    asyncio.run(served(ask))


@pytest.mark.parametrize("said", [b"", b"[]", b"nothing", b'{"posture": "dance"}', b'{"posture": [1]}', b"[" * 100_000])
def test_what_is_no_posture_is_refused_in_one_line(said: bytes) -> None:
    async def ask(client: TestClient, avatar) -> None:
        answer = await client.post("/avatar/pose", data=said, headers=JSON)
        assert answer.status == 400 and "\n" not in (await answer.json())["error"]

    asyncio.run(served(ask))


def test_pages_of_others_are_refused_whatever_they_ask_for() -> None:
    async def ask(client: TestClient, avatar) -> None:
        for path in ("/", "/studios.json", "/frame.css", "/avatar/", "/avatar/figure.glb"):
            for headers in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}):
                assert (await client.get(path, headers=headers, allow_redirects=False)).status == 403, path

    asyncio.run(served(ask))


def test_the_navigation_names_the_studios_and_the_room_that_runs_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))

    async def ask(client: TestClient, avatar) -> None:
        async def which():
            return json.loads(await (await client.get("/studios.json")).text())

        assert await which() == {"studios": ["avatar", "other"], "console": ""}
        with announced(Running("demo", "tcp/127.0.0.1:1", "c.toml", "out", 1, console="http://127.0.0.1:2/")):
            assert (await which())["console"] == "http://127.0.0.1:2/"

    asyncio.run(served(ask))

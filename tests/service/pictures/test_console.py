"""The console on a real socket: what it shows is the room, and viewers that misbehave or may not see it cost nobody anything."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import logging
import socket
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import pytest
from browser import page
from waiting import until

from vistel.conference.console import ConsoleConfig
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.skeleton import JOINTS
from vistel.render.frames import HEADER, PERSON
from vistel.session.session import AsyncSession
from vistel.v1.world_pb2 import Primitive, Thing, ThingState, WorldState
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.console import bundle, service
from vistel_services.console import gateway as gateways
from vistel_services.console.gateway import Gateway
from vistel_services.serving import server

TOKEN = "0123456789abcdef"
AVATAR = "builtin:person=ben"
HEIGHT = 1.82
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")


def posture() -> Posture:
    """Sitting, one arm forward, turned a little."""
    dofs = np.zeros(25)
    dofs[:2] = 0.1, 1.6
    dofs[2:8] = 0.1, -0.2, 0.05, 0.004, -0.003, 0.006
    dofs[11:15], dofs[18:22] = (0.2, -0.8, -0.7, 0.6), (0.0, 0.2, 1.2, 0.3)
    return Posture(dofs, np.full((2, 20), 0.2))


class Room:
    """A conference with one person, who holds still, and its console."""

    def __init__(self, console: ConsoleConfig) -> None:
        sites = [{"name": "lab", "participants": [{"name": "ben", "avatar": AVATAR, "height": HEIGHT, "program": True}]}]
        self.conference = Conference.model_validate({"name": "c", "sites": sites}).model_copy(update={"console": console})
        self.network, self.clock = MemoryNetwork(), SystemClock()
        self.paths = RunPaths(Path(), Path())  # nobody is invited
        self.address = ""
        self.gateway: Gateway | None = None

    @contextlib.asynccontextmanager
    async def watched(self, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Room]:
        """Its console serves."""
        opened: list[Any] = []

        async def open_server(*given: Any) -> Any:
            opened.append(await real(*given))
            self.gateway = given[3]["/live"].__self__
            return opened[0]

        real = service.open_server
        monkeypatch.setattr(service, "open_server", open_server)
        monkeypatch.setattr(server, "_SILENT_S", 3600.0)  # viewers are in this process: what stands still is the machine
        hub = self.network.bus("c", "hub", self.clock)
        serving = asyncio.create_task(service.run(self.conference, self.paths, hub, self.clock))
        moving = asyncio.create_task(self._move())
        try:
            await until(lambda: opened, "the console's server", tasks=[serving])
            self.address = str(opened[0].address)
            yield self
        finally:
            monkeypatch.setattr(service, "open_server", real)
            for task in (serving, moving):
                task.cancel()
            await asyncio.gather(serving, moving, return_exceptions=True)

    async def _move(self) -> None:
        session = AsyncSession(self.network.bus("c", "lab", self.clock), self.clock, "ben", self.conference)
        publisher = session.publish(display_name="Ben")
        while True:
            publisher.put(posture())
            await asyncio.sleep(1 / 60)  # a browser and sockets are served in real time


def local() -> Room:
    return Room(ConsoleConfig(at="127.0.0.1:0"))


async def heard(connection: aiohttp.ClientWebSocketResponse, kind: str) -> dict[str, Any]:
    """The next words of a kind."""
    async for said in connection:
        if said.type is aiohttp.WSMsgType.TEXT and (words := json.loads(said.data))["kind"] == kind:
            return words
    raise AssertionError(f"no {kind}")


def test_a_viewer_gets_joints_table_frames_and_the_figure_by_its_digest(monkeypatch: pytest.MonkeyPatch) -> None:
    async def watch() -> None:
        room = local()
        async with room.watched(monkeypatch), aiohttp.ClientSession() as session:  # noqa: SIM117
            async with session.ws_connect(f"http://{room.address}/live") as live:
                assert (await heard(live, "joints"))["names"] == list(JOINTS)
                table = await heard(live, "table")
                while not (table["people"] and table["people"][0]["file"] and table["room"]):
                    table = await heard(live, "table")
                async for said in live:
                    if said.type is aiohttp.WSMsgType.BINARY and HEADER.unpack_from(said.data)[3] == 1:
                        break
                assert len(said.data) == HEADER.size + PERSON.itemsize
                for digest in (table["people"][0]["file"], table["room"]):
                    async with session.get(f"http://{room.address}/asset/{digest}.glb") as answer:
                        assert answer.status == 200 and "immutable" in answer.headers["Cache-Control"]
                        assert (await answer.read())[:4] == b"glTF"
                for wrong in ("0" * 32, "x", "..%2f..%2fconference"):
                    async with session.get(f"http://{room.address}/asset/{wrong}.glb") as answer:
                        assert answer.status == 404
                numbers = await heard(live, "numbers")
                assert numbers["people"][0]["shown"] == "Ben" and numbers["viewers"] == 1

    asyncio.run(watch())


def test_who_comes_late_gets_the_dents_that_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    body, mark = Primitive(kind="sphere", params=[0.04]), Primitive(kind="sphere", params=[0.012])
    mark.pose.position.y = 0.04
    ball = Thing(id="ball", name="ball", shape="ball", primitives=[body], mass_kg=0.1, compliance=0.5, colour=0xE8B923FF)

    async def watch() -> None:
        room = local()
        async with room.watched(monkeypatch), aiohttp.ClientSession() as session:
            world = room.network.bus("c", "hub", room.clock)

            async def tell() -> None:
                for step in itertools.count(1):
                    state = WorldState(step=step, key=True, things=[ball], states=[ThingState(id="ball")])
                    state.states[0].pose.rotation.w = 1.0
                    state.dents.add(number=1, thing="ball", shape=mark, depth=0.2, left_ns=1)
                    world.publish(BY_NAME["world_state"]).put(state)
                    await asyncio.sleep(1 / 60)

            telling = asyncio.create_task(tell())
            opened: list[aiohttp.ClientWebSocketResponse] = []
            for _ in range(2):  # the second one comes when nothing changes any more
                opened.append(await session.ws_connect(f"http://{room.address}/live"))
                dents = await heard(opened[-1], "dents")
                while dents["thing"] is None:
                    dents = await heard(opened[-1], "dents")
                assert dents["thing"]["who"] == "ball"
            telling.cancel()
            for live in opened:
                await live.close()

    asyncio.run(watch())


def test_a_page_that_a_browser_has_is_not_sent_again_until_it_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    async def watch() -> None:
        room = local()
        async with room.watched(monkeypatch), aiohttp.ClientSession() as session:
            for path in ("", "console.css", "labels.css"):
                async with session.get(f"http://{room.address}/{path}") as answer:
                    tag, whole = answer.headers["ETag"], await answer.read()
                    assert answer.status == 200 and whole and answer.headers["Cache-Control"] == "no-cache"
                for known, status in ((tag, 304), (f'"x", {tag}', 304), ('"x"', 200), ("no tag at all", 200)):
                    async with session.get(f"http://{room.address}/{path}", headers={"If-None-Match": known}) as answer:
                        assert answer.status == status and await answer.read() == (whole if status == 200 else b"")
            for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
                async with session.get(f"http://{room.address}/", headers=headers | {"If-None-Match": tag}) as answer:
                    assert answer.status == 403

    asyncio.run(watch())


def test_a_note_of_the_host_goes_to_the_log_and_what_is_none_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    async def watch() -> None:
        room = local()
        recorder = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["note"], queue_all=True, polled=True)
        async with room.watched(monkeypatch), aiohttp.ClientSession() as session:  # noqa: SIM117
            async with session.ws_connect(f"http://{room.address}/live") as live:
                for wrong in ('{"note": ""}', "{", '{"note": 1, "author": "a"}', '{"note": "a", "author": "' + "x" * 41 + '"}'):
                    await live.send_str(wrong)
                    await heard(live, "refused")
                await live.send_json({"note": "the <ball> falls", "author": "Ann"})
                assert (await heard(live, "noted"))["text"] == "the <ball> falls"
                (sample,) = recorder.take()
                assert (sample.message.author, sample.message.text) == ("Ann", "the <ball> falls")
                assert abs(sample.message.header.t_ns - room.clock.now_ns()) < 60e9

    asyncio.run(watch())


def test_a_viewer_that_never_reads_costs_the_others_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    async def watch() -> None:
        room, longest, put = local(), dict[str, int](), _swollen(gateways.Viewer.put)

        def counted(viewer: Any, kind: str, message: str | bytes) -> None:
            longest[kind] = max(longest.get(kind, 0), len(message))
            put(viewer, kind, message)

        # Frames so large that the system's buffers are soon full.
        monkeypatch.setattr(gateways.Viewer, "put", counted)
        async with room.watched(monkeypatch), aiohttp.ClientSession() as session:
            deaf = await session.ws_connect(f"http://{room.address}/live", max_msg_size=0)
            stalled = next(iter(room.gateway._viewers)) if room.gateway else None
            assert stalled is not None and deaf._conn is not None and deaf._conn.transport is not None
            deaf._conn.transport.pause_reading()  # type: ignore[attr-defined]
            async with session.ws_connect(f"http://{room.address}/live", max_msg_size=0) as live:
                await heard(live, "table")
                got = 0
                while stalled.left_out < 30 or got < 25:
                    got += (await live.receive()).type is aiohttp.WSMsgType.BINARY
                assert sum(map(len, stalled._waiting.values())) <= sum(longest.values()) + SWOLLEN  # of each kind one
            await deaf.close()

    asyncio.run(watch())


def test_little_that_is_old_waits_for_a_viewer_who_is_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    handed, real = [0], gateways.Viewer.next

    async def following(viewer: Any) -> str | bytes:
        message = await real(viewer)
        handed[0] += len(message)
        return message

    def narrow(info: Any) -> socket.socket:
        made = socket.socket(info[0], info[1], info[2])
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        return made

    async def watch() -> None:
        room = local()
        monkeypatch.setattr(gateways.Viewer, "put", _swollen(gateways.Viewer.put, 10_000))
        monkeypatch.setattr(gateways.Viewer, "next", following)
        async with (
            room.watched(monkeypatch),
            aiohttp.ClientSession(connector=aiohttp.TCPConnector(socket_factory=narrow)) as session,
        ):
            deaf = await session.ws_connect(f"http://{room.address}/live", max_msg_size=0)
            stalled = next(iter(room.gateway._viewers)) if room.gateway else None
            assert stalled is not None and deaf._conn is not None and deaf._conn.transport is not None
            deaf._conn.transport.pause_reading()  # type: ignore[attr-defined]
            await until(lambda: stalled.left_out >= 20, "frames that are left out")
            assert handed[0] < 150_000
            await deaf.close()

    asyncio.run(watch())


SWOLLEN = 200_000
"""Bytes by which a frame is made longer."""


def _swollen(put: Any, more: int = SWOLLEN) -> Any:
    def swollen(viewer: Any, kind: str, message: str | bytes) -> None:
        put(viewer, kind, message + bytes(more) if isinstance(message, bytes) else message)

    return swollen


def test_pages_of_others_are_refused_and_with_a_token_who_does_not_show_it(monkeypatch: pytest.MonkeyPatch) -> None:
    paths = ("live", f"asset/{'0' * 32}.glb", "console.css")

    async def statuses(session: aiohttp.ClientSession, room: Room, **headers: str) -> list[int]:
        out: list[int] = []
        for path in paths:
            async with session.get(f"http://{room.address}/{path}", headers=headers) as answer:
                out.append(answer.status)
        return out

    async def watch() -> None:
        open_to_all, asks = local(), Room(ConsoleConfig(at="127.0.0.1:0", token=TOKEN))
        async with open_to_all.watched(monkeypatch), aiohttp.ClientSession() as session:
            assert await statuses(session, open_to_all, Host="evil.example") == [403] * 3
            assert await statuses(session, open_to_all, Origin="http://evil.example") == [403] * 3
            assert (await statuses(session, open_to_all))[1:] == [404, 200]
        async with asks.watched(monkeypatch), aiohttp.ClientSession() as session:
            assert await statuses(session, asks) == [403] * 3
            assert await statuses(session, asks, Authorization="Bearer 0123456789abcdeX") == [403] * 3
            assert (await statuses(session, asks, Authorization=f"Bearer {TOKEN}"))[1:] == [404, 200]
            async with session.get(f"http://{asks.address}/") as answer:
                assert answer.status == 403 and 'name="token"' in await answer.text()

    asyncio.run(watch())


def test_without_its_bundle_the_page_says_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for name in ("index.html", "console.css", "missing.js"):
        (tmp_path / name).write_bytes((bundle.FOLDER / name).read_bytes())
    monkeypatch.setattr(bundle, "FOLDER", tmp_path)

    async def watch() -> None:
        room = local()
        async with room.watched(monkeypatch), page(tmp_path) as tab:
            await tab.open(f"http://{room.address}/")
            await tab.until("document.getElementById('trouble').textContent.includes('make web')")

    with caplog.at_level(logging.WARNING):
        asyncio.run(watch())
    assert "event=console_page_missing" in caplog.text


def test_a_browser_shows_the_joints_where_they_are_and_comes_back(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    skeleton = builtin_avatar(AVATAR, name="ben", height=HEIGHT).skeleton
    wanted = pose_joints(skeleton, posture()).position

    async def in_place(tab: Any) -> bool:
        joints = np.array(await tab.value("window.vistel.joints('ben')"))
        return joints.shape == wanted.shape and bool(np.abs(joints - wanted).max() <= 1e-3)

    async def watch() -> None:
        room = local()
        async with page(tmp_path, *SOFTWARE_GL) as tab:
            async with room.watched(monkeypatch):
                await tab.open(f"http://{room.address}/", 480, 320)
                await tab.until("document.documentElement.dataset.begun")
                if not await tab.value("Boolean(window.vistel)"):
                    pytest.skip("this Chromium has no WebGL")
                await tab.until("window.vistel.ready() === 1")
                while not await in_place(tab):  # until it has been drawn there
                    await asyncio.sleep(0.05)
                text = await tab.value("document.body.innerText")
                assert "Ben" in text and "lab" in text
                await tab.click("#views button:nth-child(3)")
                await tab.until("document.querySelector('#views button[aria-pressed=true]').innerText.includes('eyes')")
            await tab.until("!document.getElementById('trouble').hidden")
            again = Room(ConsoleConfig(at=room.address))
            async with again.watched(monkeypatch):
                await tab.until("document.getElementById('trouble').hidden")
                await tab.click("#language")
                await tab.until(
                    "document.documentElement.lang === 'ja' && document.getElementById('panel').innerText.includes('部屋の中')"
                )
            assert not [m for m in tab.messages if "Error" in m and "WebSocket" not in m], tab.messages

    asyncio.run(watch())

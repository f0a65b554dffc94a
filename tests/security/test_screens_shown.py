"""Somebody sends a live picture that is none, too large, too often, unasked, or in the name of somebody else. What it needs: a
site's certificate, or the link of a guest."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import secrets
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from guest_room import GuestPage, GuestRoom, own_cache
from PIL import Image
from screen_stream import plain, stream_of
from waiting import until
from world_site import CONFERENCE

from vistel.conference.connect import owners_of
from vistel.protocol.pages.screen import MOST_PART_BYTES, part_of, part_record, screen_of, screen_record
from vistel.protocol.pages.screen_parts import ScreenPicture, parts_of
from vistel.session.guest_screen import MOST_RECORD_BYTES
from vistel.session.showing import page_of
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.console import guests as gateway

SAID = {"codec": "vp8", "width": 320, "height": 180}
STREAM = stream_of("vp8", [plain((n * 9, 90, 90)) for n in range(8)])


def record(n: int, data: bytes | None = None) -> bytes:
    picture = STREAM[min(n, len(STREAM) - 1)]
    return screen_record(n * 100_000 + 1, picture.data if data is None else data, key=picture.key)


def test_nobody_shows_in_the_name_of_somebody_at_another_site() -> None:
    async def run() -> None:
        network, clock = MemoryNetwork(), SimulatedClock(1_000_000_000_000)
        bus = network.bus("demo", "hub", clock, owners=owners_of(CONFERENCE))
        heard = bus.subscribe(BY_NAME["screen"], queue_all=True)
        for site in ("paris", "tokyo"):
            for part in parts_of(STREAM[0]):
                network.bus("demo", site, clock).publish(BY_NAME["screen"], participant="aiko").put(part)
        assert [s.names["site"] for s in heard.take()] == ["tokyo"]
        assert bus.counters.refused["screen"] == 1

    asyncio.run(run())


def test_records_are_whole_or_none() -> None:
    (part,) = parts_of(STREAM[0])
    assert part_of(part_record(part)) == part
    assert part_of(part_record(part) + bytes(MOST_PART_BYTES)) is None
    assert part_of(b"VP\x0b\xff\xff") is None and part_of(b"") is None
    assert screen_of(record(0)) == (True, 1, STREAM[0].data)
    assert (
        screen_of(record(0)[:12]) is None and screen_of(b"VP\x0a\x02" + bytes(30)) is None and screen_of(part_record(part)) is None
    )


@contextlib.asynccontextmanager
async def shown(folder: Path, patch: pytest.MonkeyPatch) -> AsyncIterator[tuple[GuestRoom, GuestPage, str]]:
    """A guest in the room whose panel waits for what they show live; their page listens."""
    own_cache(folder, patch)
    async with GuestRoom(folder).serving(patch) as room, room.led():
        token = room.invited()
        async with room.opened(token) as page:
            await page.enter()
            async with page.listening():
                await room.until(lambda: "guest-1" in room.moved, "Ann in the room")
                await until(lambda: page.in_the_world("guest-1"), "Ann in the world")
                await put_up(room, page, token)
                yield room, page, token


async def put_up(room: GuestRoom, page: GuestPage, token: str) -> None:
    """A panel for what the guest shows."""
    data = page_of(Image.new("RGB", (64, 36), (secrets.randbelow(255), 9, 9))).data
    async with (
        aiohttp.ClientSession() as session,
        session.post(f"http://{room.address}/guest/page", data=data, headers={"Authorization": f"Bearer {token}"}) as answer,
    ):
        assert answer.status == 200
    await page.socket.send_json({"show": "Screen of Ann", "live": True})
    await until(lambda: panels(page), "a panel")


def panels(page: GuestPage) -> list[dict[str, Any]]:
    """Those that follow Ann's screen, as a page is told."""
    return [t for t in page.newest.get("table", {}).get("things", ()) if t["screen"] == "guest-1"]


@contextlib.asynccontextmanager
async def stream(room: GuestRoom, token: str, **said: Any) -> AsyncIterator[aiohttp.ClientWebSocketResponse]:
    async with aiohttp.ClientSession() as session, session.ws_connect(f"http://{room.address}/guest/screen") as socket:
        await socket.send_json({"token": token} | SAID | said)
        yield socket


async def ended(socket: aiohttp.ClientWebSocketResponse) -> tuple[int | None, str]:
    """With what the gateway closes, and what it says."""
    reason = ""
    async for said in socket:
        reason = said.json()["reason"]
    assert "\n" not in reason
    return socket.close_code, reason


def test_a_stream_goes_to_the_bus_as_it_is_and_its_panel_goes_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play() -> None:
        async with shown(tmp_path, monkeypatch) as (room, page, token):
            heard = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["screen"], queue_all=True, polled=True)
            async with stream(room, token) as socket:
                for n in range(3):
                    await socket.send_bytes(record(n))
                came: list[Any] = []
                await until(lambda: came.extend(heard.take()) or len(came) == 3, "three pictures")
                assert [s.message.data for s in came] == [p.data for p in STREAM[:3]]
                assert {s.names["participant"] for s in came} == {"guest-1"} and {s.names["site"] for s in came} == {"guests"}
                async with stream(room, token) as second:
                    assert (await ended(second))[0] == gateway.REFUSED, "one stream of a guest"
                await socket.send_bytes(record(3))
                await until(lambda: came.extend(heard.take()) or len(came) == 4, "the first goes on")
            await until(lambda: not panels(page), "the panel has gone")

    asyncio.run(play())


def test_a_stream_without_a_visit_or_a_panel_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play() -> None:
        async with shown(tmp_path, monkeypatch) as (room, page, token):
            for other in ("no-token", room.invited("guest-2", "Bob")):
                async with stream(room, other) as socket:
                    assert (await ended(socket))[0] == gateway.REFUSED
            async with stream(room, token) as socket:
                await socket.send_bytes(record(0))
                await page.socket.send_json({"live": False})
                await until(lambda: not panels(page), "the panel has gone")
                with contextlib.suppress(ConnectionError):
                    await socket.send_bytes(record(1))
                assert await ended(socket) == (gateway.MISBEHAVED, "no panel shows it any more")

    asyncio.run(play())


LARGE = STREAM[1].data[:4] + bytes(400_000)
WRONG: dict[str, tuple[dict[str, Any], Callable[[int], bytes]]] = {
    "codec": ({"codec": "av01"}, record),
    "garbage": ({}, lambda n: record(n, bytes(500) if n else None)),
    "bytes": ({}, lambda n: screen_record(n + 1, LARGE if n else STREAM[0].data, key=not n)),
    "often": ({}, lambda n: screen_record(n + 1, STREAM[0].data, key=True)),
}
"""What a page says of its stream, and the pictures that it then sends as fast as it can."""


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_ends_the_stream_in_one_line_and_the_guest_stays(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said, sent = WRONG[name]

    async def play() -> None:
        async with shown(tmp_path, monkeypatch) as (room, page, token):
            heard = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["screen"], queue_all=True, polled=True)
            async with stream(room, token, **said) as socket:
                ending = asyncio.create_task(ended(socket))
                with contextlib.suppress(ConnectionError):
                    for n in itertools.takewhile(lambda _: not ending.done(), itertools.count()):
                        await socket.send_bytes(sent(n))
                        await asyncio.sleep(0.001)  # what the gateway says is read in between
                code, reason = await ending
            assert code == gateway.MISBEHAVED and 0 < len(reason) < 200
            await until(lambda: not panels(page), "the panel has gone")
            assert all(s.names["participant"] == "guest-1" for s in heard.take())
            assert not page.socket.closed
            moved = len(room.moved)
            await room.until(lambda: len(room.moved) > moved, "Ann is in the room")

    asyncio.run(play())


def test_a_message_that_is_too_long_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play() -> None:
        async with shown(tmp_path, monkeypatch) as (room, page, token), stream(room, token) as socket:
            await socket.send_bytes(bytes(MOST_RECORD_BYTES + 1))
            async for _ in socket:
                pass
            assert socket.close_code == aiohttp.WSCloseCode.MESSAGE_TOO_BIG
            await until(lambda: not panels(page), "the panel has gone")

    asyncio.run(play())


def test_the_panel_goes_with_the_guest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play() -> None:
        async with shown(tmp_path, monkeypatch) as (room, page, token), room.opened(room.invited("guest-2", "Bob")) as other:
            await other.enter("ben")
            async with other.listening():
                await until(lambda: panels(other), "Bob has the panel")
                async with stream(room, token) as socket:
                    await socket.send_bytes(record(0))
                    await page.socket.close()
                    await until(lambda: not panels(other), "the panel has gone")
                    with contextlib.suppress(ConnectionError):
                        await socket.send_bytes(record(1))
                    assert await ended(socket) == (gateway.REFUSED, ""), (
                        "without a word, which would end what the page shows when it is back"
                    )

    asyncio.run(play())


def test_a_picture_of_the_largest_kind_comes_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its parts follow one another on one machine without being lost."""
    from vistel.protocol.pages.screen_parts import MOST_PICTURE_BYTES, JoinedScreen

    async def play() -> None:
        async with shown(tmp_path, monkeypatch) as (room, _, token), stream(room, token) as socket:
            heard = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["screen"], queue_all=True, polled=True)
            key = STREAM[0].data
            data = key + bytes(MOST_PICTURE_BYTES - len(key))
            await socket.send_bytes(screen_record(1, data, key=True))
            screen, whole = JoinedScreen(), list[ScreenPicture]()
            await until(lambda: whole.extend(p for s in heard.take() if (p := screen.take(s.message))) or whole, "the picture")
            assert whole[0].data == data

    asyncio.run(play())

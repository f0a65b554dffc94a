"""Somebody sends pictures that are none, too large, too many, or in the name of somebody else. What it needs: a site's certificate,
or the link of a guest."""

from __future__ import annotations

import asyncio
import contextlib
import io
import struct
import zlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import pytest
from guest_room import GuestPage, GuestRoom, own_cache
from PIL import Image
from waiting import until
from world_site import CONFERENCE

from vistel.conference.connect import owners_of
from vistel.conference.room_assets import kept_asset
from vistel.messages.commands import message_of
from vistel.protocol.pages.pointer import MOST_ASKED_BYTES, asked_of, asked_record, picture_of, picture_record
from vistel.session import guest_pages
from vistel.session.pictures import Pictures
from vistel.session.showing import page_of, page_of_upload
from vistel.space.actions import Delete, Present
from vistel.space.arguments import Which
from vistel.space.pages.read import pages_of
from vistel.space.pages.sheet import MOST_BYTES, PageError, unpacked_page
from vistel.v1.motion_pb2 import AvatarPart
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.owners import MOST_NAMES
from vistel.wire.parcels import digest_of, parts_of
from vistel.wire.topics import BY_NAME

NOW_NS = 1_000_000_000_000


def png(width: int, height: int, rows: bytes = b"") -> bytes:
    """A PNG that says it has this size, with as much of it as `rows` hold."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


BOMB = png(30_000, 30_000, bytes(100_000_000))
"""100 kB that would become 2.7 GB."""
TALL = png(1, 1_000_000, bytes(4_000_000))


def picture(shade: int = 0) -> bytes:
    return page_of(Image.new("RGB", (64, 36), (shade & 255, shade >> 8, 7))).data


@pytest.mark.parametrize(
    "data",
    [BOMB, TALL, png(64, 36, b"\0" * 100), b"", b"GIF89a" + bytes(50), picture()[:-40], picture()[:60] + bytes(200)],
    ids=["bomb", "tall", "cut", "empty", "gif", "no-end", "broken"],
)
def test_what_is_no_page_is_refused_in_a_line_without_being_decoded(data: bytes) -> None:
    with pytest.raises(PageError):
        unpacked_page(data)
    with pytest.raises(PageError):
        page_of_upload(data)


def test_a_file_that_would_fill_memory_is_not_decoded(tmp_path: Path) -> None:
    for width, height in ((30_000, 30_000), (12_000, 7_000)):
        path = tmp_path / f"{width}.png"
        path.write_bytes(png(width, height, bytes(1000)))
        with pytest.raises(PageError, match="million pixels"):
            next(pages_of(path))


@pytest.mark.parametrize("text", [b"%PDF-1.7 nothing", b"%PDF-", b"\x89PNG\r\n\x1a\n", b"words"])
def test_a_file_that_is_none_is_one_line(text: bytes, tmp_path: Path) -> None:
    path = tmp_path / "file.pdf"
    path.write_bytes(text)
    with pytest.raises(PageError) as fault:
        list(pages_of(path))
    assert "\n" not in str(fault.value)


async def received(*sent: tuple[str, bytes, str]) -> tuple[list[Any], Any]:
    """What arrives of (site, bytes, digest that is said), and the counters of the bus."""
    network, clock = MemoryNetwork(), SimulatedClock(NOW_NS)
    bus = network.bus("demo", "paris", clock, owners=owners_of(CONFERENCE))
    arrived: list[Any] = []
    pictures = Pictures(bus, arrived.append)
    for site, data, digest in sent:
        sender = network.bus("demo", site, clock)
        for name, part in parts_of(data):
            sender.publish(BY_NAME["picture_part"], picture=digest, part=name).put(part)
        pictures.take()
    await until(lambda: not pictures._tasks)
    pictures.close()
    return arrived, bus.counters


def test_bytes_of_another_digest_and_sites_that_are_none_reach_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    good, other = picture(1), picture(2)
    arrived, counters = asyncio.run(
        received(
            ("tokyo", other, digest_of(good)),  # damaged, or another one
            ("nowhere", good, digest_of(good)),  # no site of the conference
            ("tokyo", b"no picture", digest_of(b"no picture")),
            ("tokyo", bytes(MOST_BYTES + 1), digest_of(bytes(MOST_BYTES + 1))),
            ("lagos", good, digest_of(good)),
        )
    )
    assert [np.asarray(s.materials[0].picture)[0, 0, 0] for s in arrived] == [1], "one sender's fault is not another's"
    assert counters.refused["picture_part"] >= 1
    assert kept_asset(arrived[0].digest) is not None


def test_a_flood_of_pictures_is_held_to_a_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    pictures = [picture(n) for n in range(MOST_NAMES["picture"] + 40)]
    arrived, counters = asyncio.run(received(*(("tokyo", data, digest_of(data)) for data in pictures)))
    assert len(arrived) == MOST_NAMES["picture"]
    assert counters.refused["picture_part"] == 40


def test_nobody_shows_in_the_name_of_somebody_at_another_site() -> None:
    async def run() -> None:
        network, clock = MemoryNetwork(), SimulatedClock(NOW_NS)
        bus = network.bus("demo", "hub", clock, owners=owners_of(CONFERENCE))
        heard = bus.subscribe(BY_NAME["command"], queue_all=True)
        present = message_of(Present(("0" * 32,), 1.0), "1", "aiko")
        for who in ("aiko", "bruno"):  # of aiko's own, and of bruno's in which aiko is said to speak
            network.bus("demo", "paris", clock).publish(BY_NAME["command"], participant=who).put(present)
        assert heard.take() == []
        assert bus.counters.refused["command"] == 2

    asyncio.run(run())


def test_records_of_the_gateway_are_whole_or_none() -> None:
    part = AvatarPart(parts=1, size=3, data=b"abc")
    record = picture_record("ab" * 16, "0000", part)
    assert picture_of(record) == ("ab" * 16, 0, part)
    assert picture_of(record[:20]) is None and picture_of(b"VP") is None and asked_of(record) is None
    command = message_of(Present(tuple(f"{n:032x}" for n in range(100)), 1.5, "x" * 60), "1" * 16, "guest-1")
    assert asked_of(asked_record(command)) == command
    assert asked_of(asked_record(command) + bytes(MOST_ASKED_BYTES)) is None
    assert asked_of(b"VP\x08\xff\xff\xff") is None


@contextlib.asynccontextmanager
async def guests(folder: Path, patch: pytest.MonkeyPatch) -> AsyncIterator[GuestRoom]:
    """A conference with guests and a world."""
    own_cache(folder, patch)
    async with GuestRoom(folder).serving(patch) as room, room.led():
        yield room


async def post(room: GuestRoom, data: bytes | AsyncIterator[bytes], token: str) -> int:
    async with (
        aiohttp.ClientSession() as session,
        session.post(f"http://{room.address}/guest/page", data=data, headers={"Authorization": f"Bearer {token}"}) as answer,
    ):
        return answer.status


async def shown(page: GuestPage) -> dict[str, Any]:
    """What the page is told of its panel."""
    await until(lambda: any(kind == "shown" for kind in page.newest))
    return page.newest.pop("shown")


def test_a_guest_shows_within_what_a_guest_may(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guest_pages, "MOST_A_VISIT", 4)

    async def play() -> None:
        async with guests(tmp_path, monkeypatch) as room:
            commands = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["command"], queue_all=True)
            token = room.invited()
            assert await post(room, picture(), "no-token") == 403
            assert await post(room, picture(), token) == 403, "nobody is there"
            async with room.opened(token) as page:
                await page.told("invited")
                assert await post(room, picture(), token) == 403, "not in the room yet"
                await page.socket.send_json({"person": "carla"})
                async with page.listening():
                    await room.until(lambda: "guest-1" in room.moved, "Ann in the room")
                    assert await post(room, BOMB, token) == 415
                    assert await post(room, bytes(MOST_BYTES + 1), token) == 413
                    assert await post(room, picture(3), token) == 200
                    assert await post(room, picture(4), token) == 200
                    await page.socket.send_json({"turn": 1})  # nothing is up yet
                    await page.socket.send_json({"show": "two\npages"})
                    assert await shown(page) == {"kind": "shown", "done": True, "reason": "", "panels": 1}
                    await page.socket.send_json({"turn": 1})
                    assert (await shown(page))["done"]
                    await page.socket.send_json({"turn": 1})
                    assert "no such page" in (await shown(page))["reason"]
                    await page.socket.send_json({"away": True})
                    assert (await shown(page))["panels"] == 0
                    assert await post(room, picture(5), token) == 200
                    assert await post(room, picture(6), token) == 429, "enough of this visit"
            given = [s.message for s in commands.take()]
            assert {m.participant for m in given} == {"guest-1"}
            assert [m.WhichOneof("action") for m in given] == ["present", "turn_page", "turn_page", "put_away"]

    asyncio.run(play())


def test_while_one_picture_of_a_guest_is_being_sent_no_other_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play() -> None:
        async with guests(tmp_path, monkeypatch) as room:
            token = room.invited()
            begun, go_on = asyncio.Event(), asyncio.Event()
            uploading = guest_pages.GuestPages.uploading

            def observed(pages: guest_pages.GuestPages) -> contextlib.AbstractAsyncContextManager[None]:
                begun.set()
                return uploading(pages)

            monkeypatch.setattr(guest_pages.GuestPages, "uploading", observed)

            async def slowly() -> AsyncIterator[bytes]:
                yield picture()[:20]
                await go_on.wait()
                yield picture()[20:]

            async with room.opened(token) as page:
                await page.enter()
                async with page.listening():
                    await room.until(lambda: "guest-1" in room.moved, "Ann in the room")
                    first = asyncio.create_task(post(room, slowly(), token))
                    await begun.wait()
                    assert await post(room, picture(1), token) == 429
                    go_on.set()
                    assert await first == 200
                    assert await post(room, picture(1), token) == 200, "its turn has come"

    asyncio.run(play())


def test_the_devices_of_guests_pass_on_no_command_but_for_panels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import socket

    from vistel.conference.device_names import microphone_name

    async def play() -> None:
        async with GuestRoom(tmp_path).serving(monkeypatch) as room:
            commands = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["command"], queue_all=True)
            file = room.paths.device(microphone_name("guest-1"))
            await until(file.exists)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
                for action in (Delete(Which(name="ball")), Present(("0" * 32,), 1.0)):
                    record = asked_record(message_of(action, "1", "guest-2"))
                    sender.sendto(record, ("127.0.0.1", int(file.read_text())))
            heard: list[Any] = []
            await until(lambda: heard.extend(commands.take()) or heard)
            assert [(s.message.WhichOneof("action"), s.message.participant) for s in heard] == [("present", "guest-1")]

    asyncio.run(play())


def test_a_picture_in_memory_is_what_was_sent() -> None:
    whole = io.BytesIO()
    Image.fromarray(np.arange(64 * 36 * 3, dtype=np.uint8).reshape(36, 64, 3)).save(whole, "PNG")
    assert page_of_upload(whole.getvalue()).aspect == pytest.approx(64 / 36)

"""What a guest's headset measures reaches the room as theirs alone, and no more of it than a headset measures."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from guest_room import GuestRoom

from vistel.protocol.pages.headset import TURN, Controller, headset_record
from vistel_services.console import guests

EYES, LOOKS = (0.0, 1.2, 0.0), (0.0, 1.0, 0.0, 0.0)
HELD = Controller((-0.2, 1.0, 0.4), (0.0, 1.0, 0.0, 0.0))


def in_room(folder: Path, patch: pytest.MonkeyPatch, play: Callable[[GuestRoom], Awaitable[None]]) -> None:
    async def played() -> None:
        async with GuestRoom(folder).serving(patch) as room:
            await play(room)

    asyncio.run(played())


def test_what_a_guests_headset_measures_is_theirs_and_impossible_poses_are_not_passed_on_and_end_the_visit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        def record() -> bytes:
            return headset_record(room.clock.now_ns(), EYES, LOOKS, right=HELD)

        async with room.opened(room.invited()) as page:
            await page.told("invited")
            await page.socket.send_bytes(record())  # before she is in the room
            await page.socket.send_json({"person": "carla"})
            right = record()
            wrong = (
                right[:4] + struct.pack("<d", float("nan")) + right[12:],
                right[:4] + struct.pack("<d", 1e9) + right[12:],
                right[:13] + struct.pack("<h", 32767) + right[15:],  # a head 3 m beside the seat
                right[:19] + struct.pack("<4h", *[TURN] * 4) + right[27:],  # turned by a quaternion of length 2
                right[:28] + struct.pack("<h", -32768) + right[30:],  # a hand 3 m off
                right[:-1],
                right[:3] + b"\x1d" + right[4:],  # joints, but as many bytes as a controller has
            )
            for said in (*wrong, right):
                await page.socket.send_bytes(said)
            await room.until(lambda: room.worn, "what is in order")
            for _ in range(guests.MOST_FAULTY):
                await page.socket.send_bytes(wrong[0])
            assert await page.code() == guests.MISBEHAVED
        room.take()
        assert [m.device for m in room.worn] == ["guest-1-headset"] and list(room.worn[0].head[:3]) == [0, 12000, 0]

    in_room(tmp_path, monkeypatch, play)


def test_a_headset_of_a_thousand_frames_a_second_ends_the_visit_and_few_are_passed_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        async with room.opened(room.invited()) as page:
            await page.enter()
            for _ in range(1000):
                await page.socket.send_bytes(headset_record(room.clock.now_ns(), EYES, LOOKS))
            assert await page.code() == guests.MISBEHAVED
        room.take()
        assert len(room.worn) <= guests.MOST_A_SECOND

    in_room(tmp_path, monkeypatch, play)

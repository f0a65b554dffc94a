"""What a guest's headset measures reaches the room as theirs alone, and no more of it than a headset measures."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from guest_room import GuestRoom, in_room, visit_with_a_flood, visit_with_faults

from vistel.protocol.pages.headset import TURN, Controller, headset_record

EYES, LOOKS = (0.0, 1.2, 0.0), (0.0, 1.0, 0.0, 0.0)
HELD = Controller((-0.2, 1.0, 0.4), (0.0, 1.0, 0.0, 0.0))


def test_what_a_guests_headset_measures_is_theirs_and_impossible_poses_are_not_passed_on_and_end_the_visit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        def measured() -> bytes:
            return headset_record(room.clock.now_ns(), EYES, LOOKS, right=HELD)

        def wrong(right: bytes) -> tuple[bytes, ...]:
            return (
                right[:4] + struct.pack("<d", float("nan")) + right[12:],
                right[:4] + struct.pack("<d", 1e9) + right[12:],
                right[:13] + struct.pack("<h", 32767) + right[15:],  # a head 3 m beside the seat
                right[:19] + struct.pack("<4h", *[TURN] * 4) + right[27:],  # turned by a quaternion of length 2
                right[:28] + struct.pack("<h", -32768) + right[30:],  # a hand 3 m off
                right[:-1],
                right[:3] + b"\x1d" + right[4:],  # joints, but as many bytes as a controller has
            )

        await visit_with_faults(room, measured, wrong, room.worn)
        assert [m.device for m in room.worn] == ["guest-1-headset"] and list(room.worn[0].head[:3]) == [0, 12000, 0]

    in_room(tmp_path, monkeypatch, play)


def test_a_headset_of_a_thousand_frames_a_second_ends_the_visit_and_few_are_passed_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        await visit_with_a_flood(room, lambda: headset_record(room.clock.now_ns(), EYES, LOOKS), room.worn)

    in_room(tmp_path, monkeypatch, play)

"""A room without files at this site: its world sends seats and walls first, and meshes while the conference runs."""

from __future__ import annotations

import asyncio
import hashlib
import math
import time
from pathlib import Path

import numpy as np

from vistel.conference.connect import connect
from vistel.conference.files import ConferenceError, with_seats
from vistel.conference.model import Conference
from vistel.v1.world_pb2 import RoomPlan
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import BusError
from vistel_cli.terminal import FAILED, err, fail
from vistel_cli.waiting import waiting

WAIT_S = 60.0
"""Longest wait for a world that does not run yet [s]."""
MOST_SEATS = 64


def with_room(conference: Conference, site: str, hub: str, wait_s: float = WAIT_S) -> Conference:
    """The conference without files that are missing at this site; their things come from the world. A file with seats and
    walls alone, kept on this machine, takes the place of the room's file."""
    room = conference.room
    missing = [t for t in room.things if t.file is not None and not t.file.is_file()]
    if missing:
        room = room.model_copy(update={"things": [t for t in room.things if t not in missing]})
    if room.file is None or room.file.is_file():
        return conference.model_copy(update={"room": room}) if missing else conference
    try:
        with waiting(f"asking the world for the room ({room.file.name} is not here)"):
            plan = asyncio.run(_asked(conference, site, hub, wait_s))
    except BusError as e:
        fail(str(e), FAILED)
    if plan is None:
        fail(
            f"room.file: {room.file} is not here, and no world that has it answers at {hub}; start the world, or copy the file",
            FAILED,
        )
    try:
        return with_seats(conference.model_copy(update={"room": room.model_copy(update={"file": _kept(plan)})}))
    except (ConferenceError, ValueError) as e:
        fail(f"room.file: {str(e).splitlines()[0]}", FAILED)


async def _asked(conference: Conference, site: str, hub: str, wait_s: float) -> RoomPlan | None:
    bus = await connect(conference, site, SystemClock(), hub)
    try:
        until = time.monotonic() + wait_s
        while time.monotonic() < until:
            plan: RoomPlan | None = await bus.query(BY_NAME["room_plan"])
            if plan is not None:
                return plan
            await asyncio.sleep(0.5)
        return None
    finally:
        await bus.close()


def _kept(plan: RoomPlan) -> Path:
    """A room file with the seats and walls of a plan."""
    from vistel.figure.avatar.cache_folder import default_cache
    from vistel.space.files import Interior, save_usd
    from vistel.space.room import Room, Seat

    if len(plan.seats) > MOST_SEATS or not all(
        math.isfinite(v) for s in plan.seats for v in (s.position.x, s.position.y, s.position.z, s.heading)
    ):
        raise ValueError("the world sent invalid seats")
    seats = tuple(Seat(np.array([s.position.x, s.position.y, s.position.z]), s.heading) for s in plan.seats)
    name = hashlib.sha256(repr([(s.position.tolist(), s.heading) for s in seats]).encode() + bytes([plan.shell])).hexdigest()[:32]
    path = default_cache().parent / "rooms" / f"plan-{name}.usda"
    if not path.is_file():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            save_usd(Interior(Room(seats, (), shell=plan.shell)), path)
        except OSError as e:
            fail(f"{path}: cannot be written: {e.strerror or e}", FAILED)
    err.print(f"room: {len(seats)} seats, and walls from the world; meshes follow from there", soft_wrap=True)
    return path

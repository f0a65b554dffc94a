"""What a world gives to sites that do not have it: on demand what is drawn of things, and of a room from files seats and walls."""

from __future__ import annotations

from vistel.conference.room_assets import kept_asset
from vistel.space.files.interior import Interior
from vistel.space.files.travel import packers
from vistel.v1.world_pb2 import RoomPlan
from vistel.wire.assets import AssetShelf
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME


def serve_assets(bus: Bus, interior: Interior | None) -> AssetShelf:
    """Answer on `bus` until the shelf is closed: with what files hold, and with what is kept on the world's machine, such as pages
    that somebody has shown. interior: of a room from files."""
    shelf = AssetShelf({} if interior is None else packers(interior), kept_asset)
    bus.serve(BY_NAME["room_asset"], shelf.answer)
    if interior is not None:
        _serve_plan(bus, interior)
    return shelf


def _serve_plan(bus: Bus, interior: Interior) -> None:
    plan = RoomPlan(shell=interior.room.shell)
    for seat in interior.room.seats:
        told = plan.seats.add(heading=seat.heading)
        told.position.x, told.position.y, told.position.z = seat.position.tolist()
    bus.serve(BY_NAME["room_plan"], lambda request: plan)

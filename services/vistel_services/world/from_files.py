"""What a world with a room from files tells sites that do not have the files: seats and walls, and on demand what is drawn."""

from __future__ import annotations

from vistel.conference.room_assets import kept_asset
from vistel.space.files.interior import Interior
from vistel.space.files.travel import packers
from vistel.v1.world_pb2 import RoomPlan
from vistel.wire.assets import AssetShelf
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME


def serve_interior(bus: Bus, interior: Interior) -> AssetShelf:
    """Answer on `bus` until the shelf is closed. A world whose machine has not the files itself serves what is kept there."""
    plan = RoomPlan(shell=interior.room.shell)
    for seat in interior.room.seats:
        told = plan.seats.add(heading=seat.heading)
        told.position.x, told.position.y, told.position.z = seat.position.tolist()
    shelf = AssetShelf(packers(interior), kept_asset)
    bus.serve(BY_NAME["room_plan"], lambda request: plan)
    bus.serve(BY_NAME["room_asset"], shelf.answer)
    return shelf

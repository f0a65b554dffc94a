"""Where the seats of a conference's room are: round the built-in table, or where the room's file has them."""

from functools import lru_cache
from pathlib import Path

from vistel.arrays import F64
from vistel.conference.model import RoomConfig
from vistel.space.room import Seat, seat_pose


def seats_of(room: RoomConfig) -> tuple[Seat, ...]:
    """The seats: those of the room's file; where it has none, or there is no file, those round the built-in table. Raises
    RoomFileError (one line)."""
    if room.file is not None and (own := _seats_in(room.file, _stamp(room.file))):
        return own
    return tuple(Seat(*seat_pose(room.seats, i)) for i in range(room.seats))


def seat_place(room: RoomConfig, index: int) -> tuple[F64, float]:
    """Position (3,) on the floor under a seat [m] and heading [rad]. Raises ValueError for no such seat, RoomFileError."""
    seats = seats_of(room) if room.file is not None else ()
    if not seats:
        return seat_pose(room.seats, index)
    if not 0 <= index < len(seats):
        raise ValueError(f"seat: expected 0 to {len(seats) - 1}, got {index}")
    return seats[index].position, seats[index].heading


@lru_cache(4)
def _seats_in(file: Path, stamp: int) -> tuple[Seat, ...]:
    from vistel.space.files.load import load_seats  # a second; only for rooms from files

    return load_seats(file)


def _stamp(file: Path) -> int:
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return 0

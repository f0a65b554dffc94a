"""Rooms and things on file: USD with our attributes, and USD, glTF and OBJ made by others.

`load_room` and `load_things` read any of them as an `Interior`: the room the world takes, and the polymeshes its things look
like; `save_usd` writes one, `load_seats` is quick. An unusable file raises `RoomFileError`, one line.
"""

from vistel.space.files.faults import RoomFileError
from vistel.space.files.interior import Interior
from vistel.space.files.load import ENDINGS, load_room, load_seats, load_things
from vistel.space.files.model import Polymesh
from vistel.space.files.usd_write import USD_ENDINGS, save_usd

__all__ = ["ENDINGS", "USD_ENDINGS", "Interior", "Polymesh", "RoomFileError", "load_room", "load_seats", "load_things", "save_usd"]

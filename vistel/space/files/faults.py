"""The error of room and thing files."""


class RoomFileError(ValueError):
    """An unusable file: the fault, its place and its remedy, in one line."""

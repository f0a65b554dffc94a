"""What is wrong with a file of a room or a thing."""


class RoomFileError(ValueError):
    """A file that cannot be used: what, where and how to mend it, in one line."""

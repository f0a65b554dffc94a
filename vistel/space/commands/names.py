"""Names that commands know: of colours, and of shapes that can be made. Plain data, so that parsing a line loads no mathematics."""

COLOURS = {
    "red": 0xC23B32FF, "orange": 0xE0762BFF, "yellow": 0xE8B923FF, "green": 0x3F9C5AFF, "blue": 0x2F6DB5FF,
    "violet": 0x8A56B0FF, "pink": 0xE08BAEFF, "brown": 0x7A5230FF, "white": 0xE6E3DAFF, "grey": 0x8A8A8AFF, "black": 0x222222FF,
}  # fmt: skip
"""Colours that have a name, 0xRRGGBBAA."""
OWN_COLOUR = {
    "ball": "yellow",
    "box": "blue",
    "cylinder": "green",
    "cone": "orange",
    "ring": "violet",
    "bar": "red",
    "lump": "brown",
    "tile": "white",
}
SHAPES = tuple(OWN_COLOUR)
"""What can be made."""

"""What a piece of a person's surface is made of; primitives carry it, the painter reads it."""

SKIN = 1
HAIR = 2
TOP = 3
COLLAR = 4
TROUSERS = 5
SHOE = 6
SOLE = 7
LIP = 8
EYE = 9

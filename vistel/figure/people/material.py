"""What a piece of a person's surface is made of; primitives carry it, the painter reads it."""

SKIN, HAIR, TOP, COLLAR, TROUSERS, SHOE, SOLE, LIP, EYE = range(1, 10)

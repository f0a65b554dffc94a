"""When a hand takes hold of a thing, and how its fingers lie on it."""

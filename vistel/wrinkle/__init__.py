"""Wrinkles of cloth and skin: shapes, displacement maps, wrinkled textures, and what drives them (Singh chapter V)."""

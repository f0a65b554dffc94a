"""Boards of the room, and what people write on them."""

"""The room that does not move: its shell with baked light, and furniture."""

"""Held things: taking, carrying, sharing, letting go, and the forces on hands."""

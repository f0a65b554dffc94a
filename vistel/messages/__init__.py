"""Conversion between messages and the values that the library computes with. Neither depends on the other."""

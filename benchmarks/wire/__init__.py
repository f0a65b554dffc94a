"""Bytes, clocks and streams."""

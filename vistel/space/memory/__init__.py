"""Dents and bonds of things, as values."""

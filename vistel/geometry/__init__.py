"""Rotations and poses, which every other part of the library may use."""

"""Shadows, occlusion and reflections."""

"""Meshes embedded in primitives (Singh §2.3)."""

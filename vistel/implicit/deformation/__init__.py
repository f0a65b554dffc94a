"""The deformable skin of a mesh, a frame at a time (Singh §2.3.2, §2.4)."""

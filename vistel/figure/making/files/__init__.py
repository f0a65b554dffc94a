"""Readers of meshes, rigs, materials and expressions from files made by others."""

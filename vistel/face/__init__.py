"""Faces: the marks that stand for them."""

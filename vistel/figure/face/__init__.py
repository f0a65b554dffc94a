"""Faces: rules after the Facial Action Coding System, what drives them, and how they move a mesh."""

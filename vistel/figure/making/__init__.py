"""Avatars made from a person's mesh: read, set upright in metres, given a skeleton, reposed, fitted with primitives."""

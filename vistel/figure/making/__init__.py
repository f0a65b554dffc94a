"""Avatars made from somebody's mesh: read, set upright in metres, given a skeleton, reposed, fitted with primitives."""

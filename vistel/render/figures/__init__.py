"""Figures as they are drawn: avatars that deform, on the CPU or the GPU, and stand-ins."""

"""Primitives <V, S, f>: the table of kinds, the shapes and their kernels (Singh §3.1, §3.2)."""

"""Ghosts: what one body adds to the field of another (Singh §2.1, §2.2, Appendix C)."""

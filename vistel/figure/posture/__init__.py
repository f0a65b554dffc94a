"""Postures, their limits, and the solver that finds them from receivers and gloves."""

"""VISTEL: Virtual Space Teleconferencing. Computation and contracts; no device and no window."""

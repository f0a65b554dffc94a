"""How kernels are compiled, and what they are built from: pointers, addresses, lanes."""

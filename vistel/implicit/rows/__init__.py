"""Programs' layout in flat arrays, and what kernels do with rows of numbers for a block of points."""

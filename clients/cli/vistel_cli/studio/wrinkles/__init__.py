"""The wrinkle studio: a page on this machine to draw wrinkles on a figure. Python computes all the mathematics."""

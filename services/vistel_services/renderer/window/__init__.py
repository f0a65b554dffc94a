"""The renderer's desktop windows: what is done at them by mouse, keyboard and 3D mouse, and the panel beside the picture."""

"""A pose that a device measured."""

DevicePose = tuple[tuple[float, float, float], tuple[float, float, float, float]]
"""Position [m] and unit quaternion (x, y, z, w), in the device's own frame or that of the bone's parent."""

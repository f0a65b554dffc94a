"""Measuring people and trackers: from receivers' poses during a few simple moves to bones, mounts and frames."""

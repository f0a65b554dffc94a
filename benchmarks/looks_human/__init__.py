"""Detectors of people that were trained by others, on pictures of ours: `python -m benchmarks.looks_human`."""

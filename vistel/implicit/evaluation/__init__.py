"""Graphs of shapes compiled to flat arrays, and evaluated for many points."""

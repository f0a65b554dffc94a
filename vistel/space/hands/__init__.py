"""Grasps: when a hand takes a thing, and the pose of its fingers on it."""

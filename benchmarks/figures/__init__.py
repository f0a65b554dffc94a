"""Figures: postures, faces, grasps, wrinkles."""

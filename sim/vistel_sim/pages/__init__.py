"""Simulated pages of guests: their mouse and keys, and what their cameras see."""

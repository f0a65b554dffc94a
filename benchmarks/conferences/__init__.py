"""Conferences: rooms, pictures, what lies between a device and a picture."""

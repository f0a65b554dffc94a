"""Glasses: frames with lenses, made for a person's head (`vistel.figure.glasses.glasses`)."""

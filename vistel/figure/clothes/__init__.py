"""Clothes: garments with cut and thickness, made for a person's body (`vistel.figure.clothes.outfit`)."""

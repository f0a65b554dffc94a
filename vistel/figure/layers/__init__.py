"""Layers under the skin of a figure: muscles, bones that show, veins, and how they are blended (Singh §4.1, §4.2)."""

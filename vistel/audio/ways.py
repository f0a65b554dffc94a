"""How voices may be placed; apart from the mathematics, so that reading a conference file loads none."""

from __future__ import annotations

from typing import Literal

Spatial = Literal["off", "pan", "hrtf"]
"""How voices are given places: not at all; panned, for loudspeakers; by transfer functions, for headphones."""

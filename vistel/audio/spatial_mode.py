"""How voices get directions. In a file of its own, so that reading a conference file loads no mathematics."""

from __future__ import annotations

from typing import Literal

SpatialMode = Literal["off", "pan", "hrtf"]
"""off: no directions; pan: panning, for loudspeakers; hrtf: head-related transfer functions, for headphones."""

"""Where the motion of simulated participants comes from: choreographies and recordings."""

from vistel_sim.motion.open import open_motion
from vistel_sim.motion.source import MotionError, MotionSource

__all__ = ["MotionError", "MotionSource", "open_motion"]

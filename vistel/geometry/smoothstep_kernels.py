"""`ease` for Numba kernels."""

from numba.extending import register_jitable

from vistel.geometry import smoothstep

ease = register_jitable(inline="always")(smoothstep.ease)
"""`smoothstep.ease`, put into the kernel that calls it before that is compiled."""

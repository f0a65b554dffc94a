"""Figures: avatars, their joints and how they deform.

    figure = vistel.figure.builtin("ben").pose(left_lower_arm=90)

What stands in `__all__` is public; it is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vistel.figure.posed import PosedFigure, builtin, load, person

__all__ = ["PosedFigure", "builtin", "load", "person"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        return getattr(import_module("vistel.figure.posed"), name)
    raise AttributeError(f"module 'vistel.figure' has no attribute {name!r}")

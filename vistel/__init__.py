"""VISTEL: lifelike figures that deform, touch and grasp in one shared room.

    import vistel.log, vistel.figure, vistel.render, vistel.implicit

    for t, posture in vistel.log.open("out/latest/conference.mcap").postures("ben"): ...
    with vistel.join("conference.toml", participant="lab") as session: ...

What stands in `__all__` here and in these modules is the public interface (docs/reference/python.md). Everything else may change.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vistel import figure, implicit, log, render, session
    from vistel.session.blocking import join

    __version__: str

__all__ = ["__version__", "figure", "implicit", "join", "log", "render", "session"]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used: `import vistel` alone loads no mathematics."""
    if name == "__version__":
        return import_module("vistel.wire.release").RELEASE
    if name == "join":
        return import_module("vistel.session.blocking").join
    if name in __all__:
        return import_module(f"vistel.{name}")
    raise AttributeError(f"module 'vistel' has no attribute {name!r}")

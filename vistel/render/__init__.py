"""Pictures of a conference's state: figures that deform, things and a room, drawn with OpenGL.

    figure = vistel.figure.builtin("ben").pose(left_lower_arm=90)
    vistel.render.picture([figure], size=(640, 480)).save("ben.png")

What stands in `__all__` is public; it is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vistel.render.gl.context import NoOpenGlError
    from vistel.render.stage.stage import Instant
    from vistel.render.still import Picture, picture
    from vistel.render.view.camera import Camera, look_at

__all__ = ["Camera", "Instant", "NoOpenGlError", "Picture", "look_at", "picture"]
_FROM = {
    "Camera": "view.camera",
    "Instant": "stage.stage",
    "NoOpenGlError": "gl.context",
    "Picture": "still",
    "look_at": "view.camera",
    "picture": "still",
}


def __getattr__(name: str) -> Any:
    if name not in _FROM:
        raise AttributeError(f"module 'vistel.render' has no attribute {name!r}")
    try:
        return getattr(import_module(f"vistel.render.{_FROM[name]}"), name)
    except ModuleNotFoundError as e:
        raise ModuleNotFoundError(f"pictures need {e.name}; pip install 'vistel[renderer]'", name=e.name) from e

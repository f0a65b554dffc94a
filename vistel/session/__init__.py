"""A running conference from a program: watch the room and the people, give commands, take part.

    with vistel.join("conference.toml", participant="aiko") as session:
        print(session.ask("create red box here").things)

What stands in `__all__` is public; it is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vistel.session.activity import run
    from vistel.session.asking import Answer
    from vistel.session.blocking import Published, Session, join
    from vistel.session.room_view import RoomView, ThingView
    from vistel.session.session import AsyncSession, LivePosture

__all__ = ["Answer", "AsyncSession", "LivePosture", "Published", "RoomView", "Session", "ThingView", "join", "run"]
_FROM = {
    "Answer": "asking",
    "AsyncSession": "session",
    "LivePosture": "session",
    "Published": "blocking",
    "RoomView": "room_view",
    "Session": "blocking",
    "ThingView": "room_view",
    "join": "blocking",
    "run": "activity",
}


def __getattr__(name: str) -> Any:
    if name in _FROM:
        return getattr(import_module(f"vistel.session.{_FROM[name]}"), name)
    raise AttributeError(f"module 'vistel.session' has no attribute {name!r}")

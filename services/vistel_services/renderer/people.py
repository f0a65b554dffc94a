"""Getting a participant's avatar, ready to deform."""

from __future__ import annotations

from pathlib import Path

from vistel.figure.avatar import Avatar
from vistel.figure.avatar_builtin import builtin_avatar, default_cache
from vistel.figure.avatar_file import load_avatar
from vistel.figure.posture import standing
from vistel_services.renderer.figures import Person
from vistel_services.renderer.stage import About


def load_avatar_of(about: About) -> Avatar:
    """The avatar a participant asks for: built in, or a file of the avatar folder. Takes seconds the first time.

    Raises ValueError or OSError when there is none of that description.
    """
    if about.avatar.startswith("builtin"):
        return builtin_avatar(about.avatar, name=about.name, height=about.height)
    if Path(about.avatar).name != about.avatar:
        raise ValueError(f"avatar: expected the name of a file in {default_cache()}, got {about.avatar!r}")
    return load_avatar(default_cache() / about.avatar)


def load_shape(about: About) -> Person:
    """The deforming figure of a participant. Raises ValueError or OSError when the avatar cannot be had."""
    person = Person(load_avatar_of(about))
    person.pose(standing())  # kernels not yet compiled on this machine are compiled here, not between two pictures
    return person

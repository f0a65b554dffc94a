"""Getting a participant's avatar, ready to deform."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from vistel.conference.model import Conference
from vistel.figure.avatar.avatar import Avatar, scaled
from vistel.figure.avatar.cache_folder import default_cache
from vistel.figure.formats.load import load_any
from vistel.figure.formats.parcel import unpack
from vistel.figure.people.builtin import WRINKLES, builtin_avatar, builtin_file
from vistel.figure.posture.posture import standing
from vistel.render.figures.cache import cached_figure, figure_of_file
from vistel.render.figures.figures import AvatarFigure
from vistel.render.stage.stage import ParticipantInfo

_NONE: Mapping[str, Path] = MappingProxyType({})


def files_of(conference: Conference) -> dict[str, Path]:
    """The avatar files that this site's conference file names, by participant."""
    people = [p for site in conference.sites for p in site.participants]
    return {p.name: Path(p.avatar) for p in people if Path(p.avatar).is_absolute()}


def no_parcel(digest: str) -> bytes:
    """Where no avatars come from other sites."""
    raise ValueError(f"avatar: parcel {digest} is not here")


def load_avatar_of(about: ParticipantInfo, files: Mapping[str, Path] = _NONE, parcel: Callable[[str], bytes] = no_parcel) -> Avatar:
    """The avatar a participant has, as tall as the participant: built in, the `parcel` they sent, or, from who sends none, a
    file that this site knows them by or one of the avatar folder. What came over the network is never taken for a path.

    Takes seconds the first time. Raises ValueError or OSError when there is none of that description.
    """
    if about.avatar.startswith("builtin"):
        return builtin_avatar(about.avatar, name=about.name, height=about.height)
    if about.parcel:
        return scaled(unpack(parcel(about.parcel), f"avatar of {about.name}"), about.height)
    known = files.get(about.name)
    if known is None and Path(about.avatar).name != about.avatar:
        raise ValueError(f"avatar: expected the name of a file in {default_cache()}, got {about.avatar!r}")
    try:
        return scaled(load_any(known or default_cache() / about.avatar), about.height)
    except FileNotFoundError as fault:
        raise ValueError(
            f"avatar: no file {about.avatar!r} beside the conference file or in {default_cache()}; copy it there"
        ) from fault


def load_figure(
    about: ParticipantInfo, files: Mapping[str, Path] = _NONE, parcel: Callable[[str], bytes] = no_parcel
) -> AvatarFigure:
    """The deforming figure of a participant. Raises ValueError or OSError when the avatar cannot be had."""
    if about.avatar.startswith("builtin"):
        file = builtin_file(about.avatar, name=about.name, height=about.height)
        person = figure_of_file(file, about.name, lambda: load_avatar_of(about), wears=WRINKLES)
    else:
        person = cached_figure(load_avatar_of(about, files, parcel))
    person.pose(standing())  # kernels not yet compiled on this machine are compiled here, not between two pictures
    return person

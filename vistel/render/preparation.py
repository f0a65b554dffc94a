"""What pictures need and what takes long to make, though no graphics are in it: people's figures and the room.

A process that waits to take over makes it ahead (`preload`); what is not there is made when it is asked for.
"""

import contextlib
from dataclasses import replace

import numpy as np

from vistel.conference.avatar_files import avatar_file
from vistel.conference.files import public_avatar
from vistel.conference.model import Conference
from vistel.conference.model import RoomConfig as RoomKeys
from vistel.figure.face.gaze import converged
from vistel.figure.formats.load import read_parcel
from vistel.figure.posture.posture import standing
from vistel.render.figures.figures import AvatarFigure, StandIn
from vistel.render.figures.people import load_figure
from vistel.render.gl.antialias import antialias
from vistel.render.room.room import Furniture, ShellPanel, build_room
from vistel.render.stage.stage import ParticipantInfo
from vistel.render.view.camera import SeatCamera
from vistel.space.files.interior import Interior
from vistel.space.room import Room, meeting_room
from vistel.wire import motion
from vistel.wire.parcels import digest_of

_Key = tuple[str, str, float]
_figures: dict[_Key, AvatarFigure] = {}
_Drawn = tuple[list[ShellPanel], Furniture | None]
_rooms: dict[int, _Drawn] = {}
_decors: dict[str, Interior] = {}


def preload(conference: Conference) -> None:
    """Make the room and the figures of everybody in the conference file; the first picture takes them."""
    seats = conference.room.seats
    if conference.room.file is None:
        _rooms[seats] = build_room(meeting_room(seats))
    if conference.room.from_files:
        with contextlib.suppress(ValueError):  # logged where it is drawn
            decor_of(conference.room)
    for p in (p for site in conference.sites for p in site.participants):
        about = ParticipantInfo(p.name, p.display_name or p.name, public_avatar(p.avatar), p.height)
        with contextlib.suppress(ValueError, OSError):  # logged when it is drawn
            file = avatar_file(p)
            parcel = read_parcel(file)[1] if file else b""
            about = replace(about, parcel=digest_of(parcel) if file else "")
            _figures[_key(about)] = load_figure(about, parcel=lambda _, parcel=parcel: parcel)
    stand_in = StandIn(1.75)
    touching = stand_in.ghosts(stand_in.pose(standing()).posed, None)
    for figure in _figures.values():
        figure.ghosts(figure.pose(standing(), [touching]).posed, None)
    _look_about(stand_in)
    compile_filter()
    motion.warm_up()


def compile_filter() -> None:
    """Load the filter of edges; where it was never compiled on this machine, that takes seconds."""
    antialias(np.zeros((8, 8, 4), np.uint8))


def _look_about(stand_in: StandIn) -> None:
    """What turns eyes and the camera of a seat, so that their kernels are loaded once for all processes."""
    seen = stand_in.pose(converged(standing(), 0.06, 1.0)).joints
    camera = SeatCamera()
    for t_ns in (0, 40_000_000):
        camera.follow(t_ns, seen)


def take_figure(about: ParticipantInfo) -> AvatarFigure | None:
    """The figure of a participant if it is there; it is the caller's from now on."""
    return _figures.pop(_key(about), None)


def take_room(seats: int) -> _Drawn:
    """The pictures of the built-in room and its furniture; made now if they are not there."""
    return _rooms.pop(seats, None) or build_room(meeting_room(seats))


def decor_of(keys: RoomKeys) -> Interior:
    """What is drawn of a room from files: shell and furniture that do not come from the world, and what things look like.

    Raises RoomFileError (one line) for files that cannot be used.
    """
    from vistel.conference.rooms import interior_of  # noqa: PLC0415  only for who has files

    name = keys.model_dump_json()
    if name not in _decors:
        whole = interior_of(keys)
        still = meeting_room(keys.seats) if keys.file is None else Room((), (), shell=whole.room.shell)
        _decors[name] = replace(whole, room=still)
    return _decors[name]


def _key(about: ParticipantInfo) -> _Key:
    """Heights to a tenth of a millimetre: on the wire they are rounded."""
    return about.parcel or about.avatar, about.name, round(about.height, 4)

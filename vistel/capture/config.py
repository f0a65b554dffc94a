"""The people and props of a site, and their devices."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vistel.conference.avatar_files import avatar_file
from vistel.conference.device_names import (
    camera_body_name,
    eye_name,
    face_name,
    glove_name,
    headset_name,
    pointer_name,
    tracker_name,
)
from vistel.conference.files import public_avatar
from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.conference.seats import seat_place
from vistel.figure.calibration.distortion import Distortion, load_distortion
from vistel.figure.calibration.files import MeasuredPerson, load_body, load_tracker
from vistel.figure.posture.posture import Stance
from vistel.figure.posture.sensors import Mount, Placement, transmitter_in_room
from vistel.wire.motion import Losses


@dataclass(frozen=True)
class Person:
    """A participant of this site, and the names of their devices; None: no such device."""

    name: str
    display_name: str
    avatar: str
    height_m: float
    seat: Stance
    """On the floor under the seat, towards the table; room frame."""
    tracker: str | None
    stations: dict[int, str]
    """Station number to receiver ("chest", ...)."""
    transmitter: Placement
    """Pose in the room."""
    gloves: Mapping[str, str]
    """Device name to side."""
    avatar_file: Path | None = None
    """File of their avatar; None for a built-in one."""
    second_tracker: str | None = None
    """With two synchronised units, the one with stations 5 to 8."""
    face: str | None = None
    """Their face camera or phone."""
    eye: str | None = None
    """The camera that sees one of their eyes."""
    pointer: str | None = None
    """A guest's page: then they have nothing else..."""
    camera_body: str | None = None
    """... but the camera of this page..."""
    headset: str | None = None
    """... and the headset with which they enter by it."""
    body: MeasuredPerson | None = None
    """Their measured body; None: a standard one of their height."""
    mounts: Mapping[str, Mount] | None = None
    """Measured mounts of the receivers on the body; None: the nominal ones."""
    distortion: Distortion | None = None
    """Measured distortion of their tracker's field by metal."""

    @property
    def not_worn(self) -> frozenset[str]:
        """Names of gloves, as a posture's silent sensors have them, that this person does not wear."""
        return frozenset({"left_glove", "right_glove"} - {f"{side}_glove" for side in self.gloves.values()})


@dataclass(frozen=True)
class TrackedProp:
    """A thing of the room that carries a receiver."""

    thing: str
    tracker: str
    """Device name."""
    station: int
    transmitter: Placement
    """Pose in the room."""
    receiver: Placement
    """Pose in the frame of the thing."""


@dataclass(frozen=True)
class Config:
    """The posture service of one site."""

    site: str
    people: tuple[Person, ...]
    props: tuple[TrackedProp, ...] = ()
    losses: Losses = "rare"
    repeats: int = 0
    """How many earlier frames each motion message repeats."""
    crowded: bool = False
    """Of the conference."""


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> Config:
    """The people and props of `site`, with their devices; not those whose part a program takes.

    Raises CalibrationFileError, DistortionError (one line) for a file of theirs that cannot be used.
    """
    if site is None:
        raise ValueError("posture: runs at a site, but none is given")
    people: list[Person] = []
    for p in site.participants:
        if p.program:
            continue
        position, heading = seat_place(conference.room, conference.seat_of(p.name))
        t = None if p.guest else p.tracker
        setup = load_tracker(t.calibration) if t and t.calibration else None
        at, towards = (
            (setup.position, setup.heading)
            if setup
            else ((np.array(t.transmitter_position), t.transmitter_heading) if t else (np.zeros(3), 0.0))
        )
        transmitter = transmitter_in_room(position, heading, at, towards)
        people.append(
            Person(
                name=p.name,
                display_name=p.display_name or p.name,
                avatar=public_avatar(p.avatar),
                height_m=p.height,
                seat=Stance(position, heading),
                tracker=tracker_name(p.name) if t else None,
                stations={station: receiver for receiver, station in t.stations.items()} if t else {},
                transmitter=transmitter,
                gloves={glove_name(p.name, side): side for side in (() if p.guest else p.gloves)},
                face=face_name(p.name) if p.face and not p.guest else None,
                eye=eye_name(p.name) if p.eye and not p.guest else None,
                pointer=pointer_name(p.name) if p.guest else None,
                camera_body=camera_body_name(p.name) if p.guest else None,
                headset=headset_name(p.name) if p.guest else None,
                avatar_file=avatar_file(p),
                second_tracker=tracker_name(p.name, 2) if t and t.second_port else None,
                body=load_body(p.body) if p.body else None,
                mounts=setup.mounts if setup else None,
                distortion=load_distortion(t.distortion) if t and t.distortion else None,
            )
        )
    position, heading = seat_place(conference.room, conference.seat_of(site.participants[0].name))
    props = tuple(
        TrackedProp(
            p.thing,
            p.device,
            p.tracker.station,
            transmitter_in_room(position, heading, p.tracker.transmitter_position, p.tracker.transmitter_heading),
            (np.array(p.tracker.receiver_position), np.array(p.tracker.receiver_rotation)),
        )
        for p in site.props
    )
    return Config(site.name, tuple(people), props, conference.motion.losses, conference.motion.repeats, bool(conference.crowd))

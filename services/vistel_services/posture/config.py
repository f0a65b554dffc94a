"""Who sits where and which devices they wear."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vistel.conference.avatar_files import avatar_file
from vistel.conference.model import Conference, Site, public_avatar
from vistel.conference.paths import RunPaths
from vistel.figure.posture import Stance
from vistel.figure.sensors import Placement, transmitter_in_room
from vistel.space.room import seat_pose


@dataclass(frozen=True)
class Person:
    """A participant of this site. tracker, glove names are None where they wear none."""

    name: str
    display_name: str
    avatar: str
    height_m: float
    seat: Stance
    """On the floor under the seat, facing the table."""
    tracker: str | None
    stations: dict[int, str]
    """Station number to receiver ("chest", ...)."""
    transmitter: Placement
    """In the room."""
    gloves: dict[str, str]
    """Device name to side."""
    face: str | None = None
    """Name of what sees their face."""
    avatar_file: Path | None = None
    """Where their avatar is read from; None for a built-in person."""


@dataclass(frozen=True)
class TrackedProp:
    """A thing of the room that carries a receiver."""

    thing: str
    tracker: str
    """Name of its tracker's device."""
    station: int
    transmitter: Placement
    """In the room."""
    receiver: Placement
    """On the thing, in its frame."""


@dataclass(frozen=True)
class Config:
    """The posture service of one site."""

    site: str
    people: tuple[Person, ...]
    props: tuple[TrackedProp, ...] = ()


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> Config:
    """The people of `site`, the devices they wear, and the props they hold."""
    if site is None:
        raise ValueError("posture: this service belongs to a site; name one")
    people: list[Person] = []
    for p in site.participants:
        position, heading = seat_pose(conference.room.seats, conference.seat_of(p.name))
        t = p.tracker
        transmitter = transmitter_in_room(
            position, heading, t.transmitter_position if t else np.zeros(3), t.transmitter_heading if t else 0.0
        )
        people.append(Person(
            name=p.name, display_name=p.display_name or p.name, avatar=public_avatar(p.avatar), height_m=p.height,
            seat=Stance(position, heading), tracker=f"{p.name}-tracker" if t else None,
            stations={station: receiver for receiver, station in t.stations.items()} if t else {},
            transmitter=transmitter, gloves={f"{p.name}-glove-{side}": side for side in p.gloves},
            face=f"{p.name}-face" if p.face else None, avatar_file=avatar_file(p),
        ))  # fmt: skip
    first = people[0].seat
    props = tuple(
        TrackedProp(
            p.thing, p.device, p.tracker.station,
            transmitter_in_room(
                first.position, first.heading, p.tracker.transmitter_position, p.tracker.transmitter_heading
            ),
            (np.array(p.tracker.receiver_position), np.array(p.tracker.receiver_rotation)),
        )
        for p in site.props
    )  # fmt: skip
    return Config(site.name, tuple(people), props)

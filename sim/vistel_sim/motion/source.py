"""Motion sources, and the bodies, seats and transmitters of the people they move."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol, runtime_checkable

import numpy as np

from vistel.arrays import F64
from vistel.conference.devices import PropTracker, TrackerConfig
from vistel.conference.model import Conference, Site
from vistel.conference.seats import seat_place
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.posture.sensors import Mount, Placement, into_frame, receiver_mounts, receiver_poses, transmitter_in_room
from vistel.figure.skeleton import Skeleton
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.space.people import Build, build_like, build_of


class MotionError(ValueError):
    """A recording that cannot be played; one line: what, where, how to mend it."""


class MotionSource(Protocol):
    """Ground truth: each participant's posture at any time, and the poses of the sensors on them.

    Times are seconds from the source's own start, any order, never negative.
    """

    @property
    def participants(self) -> tuple[str, ...]:
        """Whom this source moves."""
        ...

    def posture(self, participant: str, t_s: float) -> Posture:
        """The true posture, room frame."""
        ...

    def receivers(self, participant: str, t_s: float) -> dict[str, Placement]:
        """The tracker's four receivers in the participant's transmitter frame: position [m], quaternion x y z w."""
        ...

    def hand_angles(self, participant: str, t_s: float) -> F64:
        """(2, 20) finger joint angles, left hand first [rad]; order of `Posture.hands`."""
        ...

    def speaking(self, participant: str, t_s: float) -> float:
        """Loudness of the participant's voice, 0 (silent) to 1."""
        ...

    def things(self, t_s: float) -> dict[str, Placement]:
        """Poses of the things that the source moves (room frame), by thing id."""
        ...


@runtime_checkable
class Clapper(Protocol):
    """A motion source whose people clap."""

    def claps(self, participant: str, start_s: float, end_s: float) -> tuple[float, ...]:
        """Times of claps, from `start_s` until before `end_s`."""
        ...


@dataclass(frozen=True)
class SimulatedPerson:
    """A participant's body, as the world takes it, seat and transmitter. Seat: position (3,) in the room [m], heading about +Y
    [rad]."""

    name: str
    seat: int
    build: Build
    seat_position: F64
    seat_heading: float
    transmitter: Placement
    mounts: dict[str, Mount]

    @property
    def skeleton(self) -> Skeleton:
        """The joint chain."""
        return self.build.skeleton


AVERAGE: Mapping[str, Proportions] = MappingProxyType({})
"""Limbs of nobody: everybody is an average person of their height."""


def simulated_people(conference: Conference, limbs: Mapping[str, Proportions] = AVERAGE) -> dict[str, SimulatedPerson]:
    """Every participant of the conference at their seat. limbs: of those who are no average person of their height."""
    out: dict[str, SimulatedPerson] = {}
    for site in conference.sites:
        for person in site.participants:
            seat = conference.seat_of(person.name)
            position, heading = seat_place(conference.room, seat)
            tracker = person.tracker or TrackerConfig()
            transmitter = transmitter_in_room(position, heading, tracker.transmitter_position, tracker.transmitter_heading)
            own = limbs.get(person.name)
            build = build_of(person.height, 1.0) if own is None else build_like(own)
            mounts = receiver_mounts(build.skeleton)
            out[person.name] = SimulatedPerson(person.name, seat, build, position, heading, transmitter, mounts)
    return out


def prop_transmitter(conference: Conference, site: Site, tracker: PropTracker) -> Placement:
    """Pose of the transmitter of a prop's tracker, in the room."""
    position, heading = seat_place(conference.room, conference.seat_of(site.participants[0].name))
    return transmitter_in_room(position, heading, tracker.transmitter_position, tracker.transmitter_heading)


def receiver_on_prop(transmitter: Placement, tracker: PropTracker, pose: Placement) -> Placement:
    """Pose of the receiver on a thing at `pose` (room), in its transmitter's frame."""
    rotation = matrix_from_quaternion(pose[1])
    turn = rotation @ matrix_from_quaternion(np.array(tracker.receiver_rotation))
    at = pose[0] + rotation @ np.array(tracker.receiver_position)
    return into_frame(transmitter, at, quaternion_from_matrix(np.ascontiguousarray(turn)))


def receivers_of(person: SimulatedPerson, posture: Posture) -> dict[str, Placement]:
    """Poses of the receivers on a person in `posture`, in their transmitter's frame."""
    poses = receiver_poses(person.skeleton, pose_joints(person.skeleton, posture), person.mounts)
    return {name: into_frame(person.transmitter, *pose) for name, pose in poses.items()}

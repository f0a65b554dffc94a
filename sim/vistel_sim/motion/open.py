"""From a conference file to the motion of its participants."""

from __future__ import annotations

from vistel.conference.model import Conference
from vistel_sim.motion.meeting import Meeting
from vistel_sim.motion.source import MotionSource, places


def open_motion(conference: Conference) -> MotionSource:
    """The motion of every participant. Raises MotionError for a file that cannot be played."""
    people = places(conference)
    return Meeting(list(people.values()), conference.room.seats, conference.seed)

"""The motion of a conference's participants."""

import logging
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vistel.conference.model import Conference
from vistel.conference.room_things import extras_of
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.posture.posture import Posture
from vistel.figure.posture.sensors import Placement
from vistel.space.room import BATON
from vistel_sim.motion.bvh import load_bvh
from vistel_sim.motion.calibration import CalibrationMoves
from vistel_sim.motion.clap import Clapping
from vistel_sim.motion.clay import write_clay
from vistel_sim.motion.hand_over import play_hand_over
from vistel_sim.motion.high_five import write_high_five
from vistel_sim.motion.layout import layout_of
from vistel_sim.motion.meeting import Meeting
from vistel_sim.motion.played import PlayedFile, play_alone
from vistel_sim.motion.six_dof import ROLES, is_hand_over, load_hand_over
from vistel_sim.motion.source import AVERAGE, Clapper, MotionError, MotionSource, SimulatedPerson, simulated_people
from vistel_sim.motion.workshop import write_workshop

log = logging.getLogger("vistel.motion")

FACE_HEIGHT = 1.6
"""Of people who stand [m]."""
MEETING = "meeting"
"""The name of the built-in choreography; also what a participant without `motion` does."""
CLAY = "clay"
"""Another: who sits nearest to the first thing that takes dents presses it."""
WORKSHOP = "workshop"
"""Another: somebody opens a lid, pulls a drawer and presses a button."""
CLAP = "clap"
"""Another: everybody claps at known times."""
HIGH_FIVE = "high-five"
"""Another: two neighbours clap each other's hands."""
CALIBRATION = "calibration"
"""The moves that `vistel calibrate tracker` and `vistel calibrate body` ask for, once."""


def open_motion(conference: Conference, limbs: Mapping[str, Proportions] = AVERAGE) -> MotionSource:
    """The motion of every participant. Raises MotionError (one line) for a file that cannot be played.

    `motion` of a participant: "meeting" (or nothing), "clay", "workshop", "clap", "high-five", "calibration", a .bvh file, or the
    folder of a two-person hand-over, whose giver and taker are its first two participants; further ones watch them from their
    seats. limbs: of those who are no average person of their height.
    """
    everyone = simulated_people(conference, limbs)
    wanted: dict[str, list[SimulatedPerson]] = {}
    for site in conference.sites:
        for person in site.participants:
            wanted.setdefault(person.motion or MEETING, []).append(everyone[person.name])
    meeting = wanted.pop(MEETING, [])
    sources: list[MotionSource] = []
    if CALIBRATION in wanted:
        sources.append(CalibrationMoves(wanted.pop(CALIBRATION)))
    if CLAP in wanted:
        sources.append(Clapping(wanted.pop(CLAP)))
    if CLAY in wanted:
        thing = next((e for e in extras_of(conference.room) if e.material.remembers), None)
        if thing is None:
            raise MotionError("clay: needs a [[room.things]] whose material is plastic or viscoelastic, or that is sticky")
        write = partial(write_clay, thing=thing)
        layout = layout_of(conference.room)
        sources.append(Meeting(wanted.pop(CLAY), layout.seats, conference.seed, write=write, layout=layout))
    if WORKSHOP in wanted:
        layout = layout_of(conference.room)
        sources.append(Meeting(wanted.pop(WORKSHOP), layout.seats, conference.seed, write=write_workshop, layout=layout))
    if HIGH_FIVE in wanted:
        layout = layout_of(conference.room)
        sources.append(Meeting(wanted.pop(HIGH_FIVE), layout.seats, conference.seed, write=write_high_five, layout=layout))
    for name, people in wanted.items():
        path = Path(name)
        if path.is_dir() and is_hand_over(path):
            if len(people) < len(ROLES):
                raise MotionError(f"{path}: a hand-over needs two participants with this motion, got {len(people)}")
            first = {p.name: p for p in people[: len(ROLES)]}
            sources.append(play_hand_over(first, load_hand_over(path), conference.room.seats))
            meeting += people[len(ROLES) :]
        elif path.suffix.lower() == ".bvh":
            take = load_bvh(path)
            sources.append(PlayedFile({p.name: play_alone(p, take) for p in people}))
        else:
            raise MotionError(
                f"{name}: no such motion; expected {MEETING!r}, {CLAY!r}, {WORKSHOP!r}, {CLAP!r}, {HIGH_FIVE!r}, {CALIBRATION!r}, a"
                " .bvh file or a folder with *_pose_saved.csv files"
            )
        log.info("motion from file path=%s participants=%s", path, ",".join(p.name for p in people))
    if meeting:
        acts = next((s for s in sources if s.things(0.0)), None)
        layout = layout_of(conference.room)
        sources.append(Meeting(meeting, layout.seats, conference.seed, _gaze_at(acts) if acts else None, layout=layout))
    return sources[0] if len(sources) == 1 else _CombinedSource(sources)


def check_file(path: Path) -> None:
    """Raises MotionError (one line) for a file or a folder that cannot be played."""
    if path.suffix.lower() == ".bvh":
        load_bvh(path)
    elif is_hand_over(path):
        load_hand_over(path)
    else:
        inside = [p.name for p in sorted(path.iterdir()) if p.is_dir() and is_hand_over(p)] if path.is_dir() else []
        mend = f"; did you mean {path / inside[0]}?" if inside else ""
        raise MotionError(f"{path}: expected a .bvh file or a folder with *_pose_saved.csv files{mend}")


def things_of(path: Path) -> tuple[str, ...]:
    """Ids of the things of the room that a recording moves beside its people."""
    return (BATON,) if path.is_dir() and is_hand_over(path) else ()


def _gaze_at(acts: MotionSource) -> Callable[[float], NDArray[np.float64]]:
    """Where onlookers look: between the thing and the faces above it."""

    def point(t_s: float) -> NDArray[np.float64]:
        at = next(iter(acts.things(t_s).values()))[0]
        return np.array([at[0], 0.3 * at[1] + 0.7 * FACE_HEIGHT, at[2]])

    return point


class _CombinedSource:
    """Several sources, each with people of its own."""

    def __init__(self, sources: Sequence[MotionSource]) -> None:
        self._sources = sources
        self._of = {name: s for s in sources for name in s.participants}

    @property
    def participants(self) -> tuple[str, ...]:
        return tuple(self._of)

    def posture(self, participant: str, t_s: float) -> Posture:
        return self._of[participant].posture(participant, t_s)

    def receivers(self, participant: str, t_s: float) -> dict[str, Placement]:
        return self._of[participant].receivers(participant, t_s)

    def hand_angles(self, participant: str, t_s: float) -> NDArray[np.float64]:
        return self._of[participant].hand_angles(participant, t_s)

    def speaking(self, participant: str, t_s: float) -> float:
        return self._of[participant].speaking(participant, t_s)

    def claps(self, participant: str, start_s: float, end_s: float) -> tuple[float, ...]:
        source = self._of[participant]
        return source.claps(participant, start_s, end_s) if isinstance(source, Clapper) else ()

    def things(self, t_s: float) -> dict[str, Placement]:
        return {name: pose for s in self._sources for name, pose in s.things(t_s).items()}

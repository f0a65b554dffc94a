"""Recorded postures for the figure's benchmark: recordings under ../shared/data/body, carried over to a standard person."""

from pathlib import Path

import numpy as np

from vistel.conference.model import Conference, Participant, Site
from vistel.figure.posture.posture import Posture
from vistel_sim.motion.bvh import load_bvh
from vistel_sim.motion.played import RATE_HZ, Played, play_alone
from vistel_sim.motion.six_dof import load_hand_over
from vistel_sim.motion.source import simulated_people

DATA = Path(__file__).resolve().parents[3] / "shared/data/body"


def recorded_postures(count: int = 200) -> list[Posture]:
    """`count` postures, evenly spread over the whole time of all recordings; the same ones on every machine. None where
    the recordings are not there."""
    person = next(
        iter(simulated_people(Conference(name="sweep", sites=[Site(name="here", participants=[Participant(name="who")])])).values())
    )
    takes = [load_bvh(p) for p in sorted((DATA / "cmu").glob("*.bvh"))] if (DATA / "cmu").is_dir() else []
    folder = DATA / "kth_handover" / "take_new"
    if folder.is_dir():
        takes += load_hand_over(folder).people.values()
    if not takes:
        return []
    lengths = np.array([t.duration_s for t in takes])
    ends = np.cumsum(lengths)
    players: dict[int, Played] = {}
    out: list[Posture] = []
    for t in (np.arange(count) + 0.5) * ends[-1] / count:
        k = int(np.searchsorted(ends, t))
        if k not in players:
            players[k] = play_alone(person, takes[k])
        at = t - (ends[k] - lengths[k])
        posture = players[k].posture(max(0.0, min(at, lengths[k] - 1.0 / RATE_HZ)))
        # Where somebody stands in the room is nothing to their skin.
        out.append(Posture(posture.dofs, posture.hands))
    return out

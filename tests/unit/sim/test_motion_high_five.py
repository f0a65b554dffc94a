"""Two neighbours clap each other's hands."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vistel.conference.model import Conference
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel_sim.motion import open_motion
from vistel_sim.motion.high_five import CLAPS_S, PALM_M
from vistel_sim.motion.source import MotionSource, simulated_people


def conference(people: int) -> Conference:
    some = [{"name": f"p{n}", "height": 1.7, "motion": "high-five"} for n in range(people)]
    return Conference.model_validate({"room": {"seats": 3}, "sites": [{"name": "a", "participants": some}]})


def wrist(meeting: Conference, source: MotionSource, name: str, side: str, t_s: float) -> np.ndarray:
    pose = pose_joints(simulated_people(meeting)[name].skeleton, source.posture(name, t_s))
    return pose.position[JOINT_INDEX[f"{side}_hand"]]


def test_hands_of_neighbours_come_together_at_each_clap_and_part_between() -> None:
    meeting = conference(3)
    source = open_motion(meeting)

    def apart(t_s: float) -> float:
        return float(np.linalg.norm(wrist(meeting, source, "p0", "right", t_s) - wrist(meeting, source, "p1", "left", t_s)))

    assert all(2 * PALM_M - 0.01 < apart(t) < 2 * PALM_M + 0.05 for t in CLAPS_S)
    assert all(apart(0.5 * (a + b)) > 0.28 for a, b in pairwise(CLAPS_S))


def test_one_alone_claps_nobody() -> None:
    meeting = conference(1)
    source = open_motion(meeting)
    places = [wrist(meeting, source, "p0", "right", t) for t in np.arange(0.0, CLAPS_S[-1], 0.25)]
    assert np.linalg.norm(np.ptp(places, axis=0)) < 0.6, "gestures, but no arm is stretched"

"""A simulated tracking suite's bones, over VMC, are what a tracker's receivers on the same body would read."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.conference.model import Conference, Participant, Site, TrackerConfig
from vistel.figure.posture import pose_joints
from vistel_services.tracker import VmcDecoder
from vistel_sim import suite
from vistel_sim.motion import open_motion
from vistel_sim.motion.source import places


@pytest.mark.parametrize("t_s", [0.0, 2.5, 6.0])
def test_receivers_are_where_the_body_has_them(t_s: float) -> None:
    person = Participant(name="ann", height=1.64, tracker=TrackerConfig(kind="vmc"))
    conference = Conference(sites=[Site(name="a", participants=[person])])
    motion, place = open_motion(conference), places(conference)["ann"]
    data = suite.packet(pose_joints(place.skeleton, motion.posture("ann", t_s)), place.transmitter)
    (frame,) = VmcDecoder("ann-tracker", 1.64).feed(data, 10**9)
    want = motion.receivers("ann", t_s)
    for r, role in zip(frame.receivers, ("chest", "head", "left_hand", "right_hand"), strict=True):
        p, q = want[role]
        assert [r.position.x, r.position.y, r.position.z] == pytest.approx(list(p), abs=2e-3)
        assert abs(np.dot([r.rotation.x, r.rotation.y, r.rotation.z, r.rotation.w], q)) > 0.99999

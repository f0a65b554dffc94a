"""A simulated tracking suite's bones, over VMC, are what a tracker's receivers on the same body would read."""

from __future__ import annotations

import math
import socket
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from device_site import STATE, RecordingBus, Running, run
from virtual_time import LoopClock

from vistel.capture.body import BodyCapture
from vistel.capture.vmc_frames import VmcDecoder
from vistel.conference.devices import TrackerConfig
from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.messages.postures import LEGS, posture_of, rotations_of
from vistel.protocol import live_link_face, osc
from vistel.v1.device_pb2 import TrackerFrame
from vistel.wire.motion import MotionDecoder, MotionEncoder, MotionSample
from vistel_services import tracker
from vistel_services.posture import configure
from vistel_sim import suite
from vistel_sim.faults import Fault
from vistel_sim.motion import open_motion
from vistel_sim.motion.source import simulated_people
from vistel_sim.process import simulators

T = "ann-tracker"


@pytest.mark.parametrize("t_s", [0.0, 2.5, 6.0])
def test_receivers_are_where_the_body_has_them(t_s: float) -> None:
    person = Participant(name="ann", height=1.64, tracker=TrackerConfig(kind="vmc"))
    conference = Conference(sites=[Site(name="a", participants=[person])])
    motion, simulated = open_motion(conference), simulated_people(conference)["ann"]
    data = suite.packet(pose_joints(simulated.skeleton, motion.posture("ann", t_s)), simulated.transmitter)
    (frame,) = VmcDecoder("ann-tracker", 1.64).feed(data, 10**9)
    want = motion.receivers("ann", t_s)
    for r, role in zip(frame.receivers, ("chest", "head", "left_hand", "right_hand"), strict=True):
        p, q = want[role]
        assert [r.position.x, r.position.y, r.position.z] == pytest.approx(list(p), abs=2e-3)
        assert abs(np.dot([r.rotation.x, r.rotation.y, r.rotation.z, r.rotation.w], q)) > 0.99999


def test_elbows_fingers_and_legs_are_those_of_the_body(tmp_path: Path) -> None:
    person = Participant(name="ann", height=1.64, tracker=TrackerConfig(kind="vmc"))
    conference = Conference(sites=[Site(name="a", participants=[person])])
    motion, simulated = open_motion(conference), simulated_people(conference)["ann"]
    decoder = VmcDecoder("ann-tracker", 1.64)
    (who,) = configure(conference, conference.sites[0], RunPaths(tmp_path, tmp_path)).people
    capture = BodyCapture(who)
    solved = None
    for k in range(120):
        truth = motion.posture("ann", 3.0 + k / 60)
        # One foot forward and up, as no seat would have it.
        truth = replace(truth, joints={"left_upper_leg": np.array([-1.9, 0.0, 0.2]), "left_foot": np.array([0.4, 0.0, 0.0])})
        pose = pose_joints(simulated.skeleton, truth)
        for frame in decoder.feed(suite.packet(pose, simulated.transmitter), 10**9 + k * 10**9 // 60):
            if capture.tracker(frame):
                solved = capture.solve(capture.newest_ns)
    assert solved is not None and "legs" not in solved.stale
    back = pose_joints(simulated.skeleton, solved.posture)
    assert solved.posture.hands == pytest.approx(truth.hands, abs=1e-4)
    for joint in ("left_lower_arm", "right_lower_arm"):
        assert back.position[JOINT_INDEX[joint]] == pytest.approx(pose.position[JOINT_INDEX[joint]], abs=0.02)
    for joint in LEGS:
        turn = back.rotation[JOINT_INDEX[joint]].T @ pose.rotation[JOINT_INDEX[joint]]
        assert math.acos(min(1.0, (np.trace(turn) - 1.0) / 2.0)) < math.radians(2.0), joint
    sample = MotionSample(1, 0, solved.posture.dofs, solved.posture.hands, np.zeros(4), legs=rotations_of(solved.posture, LEGS))
    heard = MotionDecoder().decode(MotionEncoder().encode(sample))
    assert heard is not None
    seen = posture_of(heard).joints
    assert seen.keys() == set(LEGS)
    assert all(seen[name] == pytest.approx(solved.posture.joints[name], abs=math.radians(0.2)) for name in LEGS)


class Suite(Running):
    """The tracker service and a simulated suite that sends to it, over UDP."""

    def __init__(self, folder: Path, faults: tuple[Fault, ...] = (), sends: bool = True) -> None:
        person = Participant(name="ann", height=1.64, gloves={}, tracker=TrackerConfig(kind="vmc"))
        conference = Conference(sites=[Site(name="a", participants=[person])])
        self.bus, self.clock = RecordingBus(), LoopClock()
        self.paths = RunPaths(folder, folder)
        start_ns = self.clock.now_ns()
        work = [tracker.run(tracker.configure(conference, conference.sites[0], self.paths), self.bus, self.clock)]
        if sends:
            senders = simulators(conference, open_motion(conference), self.paths, self.clock, start_ns, faults=faults)
            work += [s.run() for s in senders]
        super().__init__(work)

    @property
    def frames(self) -> list[TrackerFrame]:
        return self.bus.on("tracker", T)


def test_a_suite_whose_network_goes_is_missed_and_heard_again(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = Suite(tmp_path, (Fault(T, "garbage", 0.5, 0.3), Fault(T, "unplug", 1.0, 1.0)))
        try:
            await site.until(lambda: STATE.STATE_STALLED in site.bus.states(T))
            before = len(site.frames)
            await site.until(lambda: len(site.frames) > before + 30)
            assert site.bus.status(T).state == STATE.STATE_STREAMING
            assert site.bus.status(T).bytes_skipped > 0
        finally:
            await site.close()
        for frame in site.frames:
            assert [r.station for r in frame.receivers] == [1, 2, 3, 4]
            for q in (r.rotation for r in frame.receivers):
                assert abs(math.hypot(q.x, q.y, q.z, q.w) - 1.0) < 1e-5

    run(scenario())


@pytest.mark.parametrize(
    ("packet", "said"),
    [
        (
            live_link_face.encode(live_link_face.FacePacket("id", "Ann", 7, 0.0, (60, 1), (0.5,) * 61)),
            "Live Link Face sends to this port; a VMC tracking suite was expected",
        ),
        (osc.encode("/chataigne/1", 0.5), "a program that speaks OSC sends to this port; a VMC tracking suite was expected"),
        (b"hello", "what arrives is not from a VMC tracking suite; is another program sending to this port?"),
    ],
)
def test_who_else_sends_to_the_port_is_named(tmp_path: Path, packet: bytes, said: str) -> None:
    async def scenario() -> None:
        site = Suite(tmp_path, sends=False)
        try:
            await site.until(lambda: site.paths.device(T).exists())
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
                port = int(site.paths.device(T).read_text())

                def told() -> bool:
                    other.sendto(packet, ("127.0.0.1", port))
                    return any(s.detail == said for s in site.bus.on("device_status", T))

                await site.until(told)
        finally:
            await site.close()

    run(scenario())

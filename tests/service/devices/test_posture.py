"""The posture service: tracker and glove frames in, Motion out."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Coroutine
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import until

from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.figure.posture.posture import Posture, Stance, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.v1.device_pb2 import GloveFrame, TrackerFrame, TrackerReceiver
from vistel.wire.bus import Sample
from vistel.wire.clock import SimulatedClock
from vistel.wire.motion import MotionDecoder, MotionSample, StalePart
from vistel.wire.topics import BY_NAME, Topic
from vistel.wire.uplink import Uplink
from vistel_services import posture
from vistel_sim.motion import MotionSource, open_motion

AVERAGE = "nobody.usda"
"""No such file, so that ann is of average limbs, as those whom simulated devices move."""
CONFERENCE = Conference(
    sites=[
        Site(name="a", participants=[Participant(name="ann", avatar=AVERAGE)]),
        Site(name="b", participants=[Participant(name="ben")]),
        Site(name="c", participants=[Participant(name="cas")]),
    ]
)
RECORD_S = 1.0 / 120.0


class _Queue:
    def __init__(self) -> None:
        self._queue: asyncio.Queue[Sample] = asyncio.Queue()

    def give(self, topic: Topic, message: Any, device: str) -> None:
        self._queue.put_nowait(Sample(topic, "", {"device": device, "site": "a"}, message, 0))

    def take(self) -> list[Sample]:
        return [self._queue.get_nowait() for _ in range(self._queue.qsize())]

    async def __aiter__(self) -> AsyncIterator[Sample]:
        while True:
            yield await self._queue.get()

    def close(self) -> None:
        pass


@dataclass
class _Publication:
    sent: list[Any]
    next_seq: int = 1

    def put(self, message: Any) -> None:
        self.sent.append(message)
        self.next_seq += 1


@dataclass
class _Bus:
    """Hands messages straight to one service and keeps what it says."""

    conference: str = "test"
    site: str = "a"
    sent: dict[str, list[Any]] = field(default_factory=dict)
    inputs: dict[str, _Queue] = field(default_factory=dict)
    present: list[str] = field(default_factory=list)
    uplink: Uplink = field(default_factory=Uplink)

    def publish(self, topic: Topic, **_names: str) -> _Publication:
        return _Publication(self.sent.setdefault(topic.name, []))

    def subscribe(self, topic: Topic, *, queue_all: bool = False, polled: bool = False, **_names: str) -> _Queue:
        return self.inputs.setdefault(topic.name, _Queue())

    def announce(self, token: str) -> None:
        self.present.append(token)


class Stage:
    """Ann's service fed by the made-up meeting, on simulated time: a record every 1/120 s, stations in turn."""

    def __init__(self) -> None:
        self.bus = _Bus()
        self.clock = SimulatedClock(1_000_000_000_000)
        self.start_ns = self.clock.now_ns()
        self.source: MotionSource = open_motion(CONFERENCE)
        self.order = ("chest", "head", "left_hand", "right_hand")
        self.newest: dict[int, TrackerReceiver] = {}
        self.silent: set[str] = set()
        self.spoil: Callable[[TrackerReceiver], None] = lambda _r: None
        self.records = 0

    async def play(self, seconds: float) -> None:
        for _ in range(round(seconds / RECORD_S)):
            self.records += 1
            t_ns = self.start_ns + round(self.records * RECORD_S * 1e9)
            await self.clock.advance_to_ns(t_ns)
            self.record(t_ns)
            if self.records % 2 == 0:
                self.gloves(t_ns)
            for _ in range(5):
                await asyncio.sleep(0)

    def record(self, t_ns: int) -> None:
        station = (self.records - 1) % 4
        name = self.order[station]
        if name in self.silent:
            return
        p, q = self.source.receivers("ann", (t_ns - self.start_ns) * 1e-9)[name]
        receiver = TrackerReceiver(station=station + 1, t_ns=t_ns, health=TrackerReceiver.HEALTH_GOOD)
        receiver.position.x, receiver.position.y, receiver.position.z = p
        receiver.rotation.x, receiver.rotation.y, receiver.rotation.z, receiver.rotation.w = q
        self.spoil(receiver)
        self.newest[station] = receiver
        frame = TrackerFrame(device="ann-tracker", receivers=self.newest.values())
        frame.header.t_ns = t_ns
        self.bus.inputs["tracker"].give(BY_NAME["tracker"], frame, "ann-tracker")

    def gloves(self, t_ns: int) -> None:
        angles = self.source.hand_angles("ann", (t_ns - self.start_ns) * 1e-9)
        for row, side in enumerate(("left", "right")):
            if f"{side}_glove" not in self.silent:
                device = f"ann-glove-{side}"
                frame = GloveFrame(device=device, right=row == 1, angles=angles[row])
                frame.header.t_ns = t_ns
                self.bus.inputs["glove"].give(BY_NAME["glove"], frame, device)

    def motions(self) -> list[MotionSample]:
        decoder = MotionDecoder()
        out = [decoder.decode(m) for m in self.bus.sent.get("motion", [])]
        assert None not in out
        return out  # type: ignore[return-value]

    def truth(self, sample: MotionSample) -> Posture:
        return self.source.posture("ann", (sample.t_ns - self.start_ns) * 1e-9)


def perform(script: Callable[[Stage], Coroutine[Any, Any, None]], tmp_path: Path, conference: Conference = CONFERENCE) -> Stage:
    """Run the service while `script` plays."""

    async def scenario() -> Stage:
        stage = Stage()
        config = posture.configure(conference, conference.sites[0], RunPaths(tmp_path, tmp_path))
        task = asyncio.create_task(posture.run(config, stage.bus, stage.clock))  # type: ignore[arg-type]
        await ready(stage.bus, task)
        await script(stage)
        assert not task.done()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return stage

    return asyncio.run(scenario())


async def ready(bus: _Bus, service: asyncio.Task[None]) -> None:
    """The service has compiled what it needs and said who is there."""
    await until(lambda: bus.present or service.done())
    if service.done():
        service.result()


def posture_of(sample: MotionSample) -> Posture:
    return Posture(sample.body, sample.hands, Stance(sample.stance[:3], float(sample.stance[3])))


def joint_steps(samples: list[MotionSample]) -> np.ndarray:
    """(n-1, J) metres each joint moves from one motion to the next."""
    skeleton = standard_skeleton()
    at = np.array([pose_joints(skeleton, posture_of(s)).position for s in samples])
    return np.linalg.norm(np.diff(at, axis=0), axis=2)


def test_motion_follows_the_person_sixty_times_a_second(tmp_path: Path) -> None:
    stage = perform(lambda s: s.play(6.0), tmp_path)
    samples = stage.motions()
    assert 350 <= len(samples) <= 365
    skeleton = standard_skeleton()
    errors = []
    for s in samples[30:]:
        true, solved = pose_joints(skeleton, stage.truth(s)), pose_joints(skeleton, posture_of(s))
        errors.append(np.linalg.norm(true.position - solved.position, axis=1))
    errors = np.array(errors)
    # Receivers are measured up to 25 ms apart and filtered; a hand moves at up to 1 m/s.
    for joint, most in (("left_hand", 0.012), ("right_hand", 0.012), ("head", 0.006), ("hips", 0.006)):
        assert np.median(errors[:, JOINT_INDEX[joint]]) < most
        assert errors[:, JOINT_INDEX[joint]].max() < 5 * most
    assert np.abs([stage.truth(s).hands - s.hands for s in samples[30:]]).max() < np.radians(12.0)
    assert all(s.stale == StalePart(0) for s in samples[30:])


def test_a_motion_carries_the_time_of_its_newest_measurement(tmp_path: Path) -> None:
    stage = perform(lambda s: s.play(1.0), tmp_path)
    times = [s.t_ns for s in stage.motions()]
    measured = {stage.start_ns + round(k * RECORD_S * 1e9) for k in range(1, stage.records + 1)}
    assert times and set(times) <= measured
    assert all(b > a for a, b in pairwise(times))


def test_who_is_there_is_published_once_and_their_presence_declared(tmp_path: Path) -> None:
    stage = perform(lambda s: s.play(0.1), tmp_path)
    (about,) = stage.bus.sent["participant"]
    assert (about.participant, about.site, about.avatar) == ("ann", "a", AVERAGE)
    assert about.height_m == pytest.approx(1.75)
    assert stage.bus.present == ["participant-ann"]


def test_a_silent_receiver_is_flagged_and_neither_its_loss_nor_its_return_snaps(tmp_path: Path) -> None:
    async def script(stage: Stage) -> None:
        await stage.play(2.0)
        stage.silent = {"right_hand"}
        await stage.play(3.0)
        stage.silent = set()
        await stage.play(2.0)

    samples = perform(script, tmp_path).motions()
    stale = [bool(s.stale & StalePart.RIGHT_HAND) for s in samples]
    assert not any(stale[10:120]) and all(stale[150:295]) and not any(stale[320:])
    # 10 cm in a sixtieth of a second is 6 m/s: nobody at a table is that quick.
    assert joint_steps(samples[20:]).max() < 0.10


def test_gloves_that_nobody_wears_are_not_called_silent_and_those_that_are_worn_are(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def script(stage: Stage) -> None:
        stage.silent = {"left_glove", "right_glove"}
        await stage.play(3.0)

    bare = Conference(sites=[Site(name="a", participants=[Participant(name="ann", avatar=AVERAGE, gloves={})])])
    perform(script, tmp_path, bare)
    assert [r.getMessage() for r in caplog.records if "silent" in r.getMessage()] == []
    perform(script, tmp_path)
    assert "sensor silent participant=ann sensor=left_glove" in [r.getMessage() for r in caplog.records]


def test_a_sensor_that_pauses_for_less_than_two_seconds_is_not_told_of(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    async def script(stage: Stage) -> None:
        for seconds in (1.5, 2.5):
            await stage.play(1.0)
            stage.silent = {"left_glove"}
            await stage.play(seconds)
            stage.silent = set()
        await stage.play(1.0)

    with caplog.at_level(logging.INFO, "vistel.posture"):
        perform(script, tmp_path)
    told = [m for r in caplog.records if (m := r.getMessage()).startswith("sensor")]
    assert told == [f"sensor {what} participant=ann sensor=left_glove" for what in ("silent", "back")]


def test_a_backlog_of_three_seconds_that_arrives_at_once_makes_no_sensor_look_silent(tmp_path: Path) -> None:
    async def script(stage: Stage) -> None:
        for stage.records in range(1, 360):
            t_ns = stage.start_ns + round(stage.records * RECORD_S * 1e9)
            stage.record(t_ns)
            if stage.records % 2 == 0:
                stage.gloves(t_ns)
        await until(lambda: len(stage.bus.sent.get("motion", [])) > 170)

    samples = perform(script, tmp_path).motions()
    assert all(s.stale == StalePart(0) for s in samples[5:])


def test_with_the_tracker_unplugged_motion_goes_on_by_the_clock_and_relaxes(tmp_path: Path) -> None:
    async def script(stage: Stage) -> None:
        await stage.play(2.0)
        stage.silent = {"chest", "head", "left_hand", "right_hand", "left_glove", "right_glove"}
        await stage.play(8.0)

    samples = perform(script, tmp_path).motions()
    last = samples[-1]
    assert last.stale == StalePart.CHEST | StalePart.HEAD | StalePart.LEFT_HAND | StalePart.RIGHT_HAND | (
        StalePart.LEFT_GLOVE | StalePart.RIGHT_GLOVE
    )
    assert len(samples) > 570
    assert joint_steps(samples[20:]).max() < 0.10
    # At rest at the end.
    assert joint_steps(samples[-30:]).max() < 0.002


def test_samples_no_receiver_can_mean_are_left_out(tmp_path: Path) -> None:
    async def script(stage: Stage) -> None:
        await stage.play(1.0)

        def spoil(r: TrackerReceiver) -> None:
            if r.station == 3:
                r.position.x = float("nan")
            if r.station == 4:
                r.health = TrackerReceiver.HEALTH_UNTRUSTED

        stage.spoil = spoil
        await stage.play(1.5)

    samples = perform(script, tmp_path).motions()
    assert np.isfinite([s.body for s in samples]).all()
    assert samples[-1].stale == StalePart.LEFT_HAND | StalePart.RIGHT_HAND


def test_frames_of_unknown_devices_and_stations_change_nothing(tmp_path: Path) -> None:
    async def script(stage: Stage) -> None:
        await stage.play(0.5)
        frame = TrackerFrame(device="zoe-tracker", receivers=[TrackerReceiver(station=1, t_ns=stage.start_ns)])
        stage.bus.inputs["tracker"].give(BY_NAME["tracker"], frame, "zoe-tracker")
        frame = TrackerFrame(device="ann-tracker", receivers=[TrackerReceiver(station=9, t_ns=stage.start_ns)])
        stage.bus.inputs["tracker"].give(BY_NAME["tracker"], frame, "ann-tracker")
        stage.bus.inputs["glove"].give(BY_NAME["glove"], GloveFrame(angles=[1.0, 2.0]), "ann-glove-left")
        await stage.play(0.5)

    assert perform(script, tmp_path).motions()[-1].stale == StalePart(0)


def test_a_participant_without_a_tracker_sits_at_rest(tmp_path: Path) -> None:
    conference = Conference(
        sites=[Site(name="a", participants=[Participant(name="ann", tracker=None, gloves={})])], room={"seats": 3}
    )

    async def scenario() -> list[Any]:
        bus, clock = _Bus(), SimulatedClock(5_000_000_000)
        config = posture.configure(conference, conference.sites[0], RunPaths(tmp_path, tmp_path))
        task = asyncio.create_task(posture.run(config, bus, clock))  # type: ignore[arg-type]
        await ready(bus, task)
        await clock.advance_to_ns(8_000_000_000)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return bus.sent["motion"]

    messages = asyncio.run(scenario())
    decoder = MotionDecoder()
    last = [decoder.decode(m) for m in messages][-1]
    assert last is not None
    skeleton = standard_skeleton()
    joints = pose_joints(skeleton, posture_of(last))
    hips, head = joints.position[0], joints.position[JOINT_INDEX["head"]]
    assert 0.4 < hips[1] < 0.65 and 1.0 < head[1] < 1.4
    assert np.hypot(hips[0], hips[2] + 0.78) < 0.1

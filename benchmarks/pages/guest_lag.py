"""How late a guest's figure at another site follows the pictures of their webcam, without the browser: landmarks as a page finds
them go up thirty times a second, and the figure's hand is compared with the true one of each picture."""

import asyncio
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.pages.guest_seats import LOOK_S, seated
from benchmarks.pages.light_guests import CYCLE, RATES, LightGuest, at_rate, raising_arms, seen_by_camera
from benchmarks.pages.live_conference import LiveConference, beside, guest, live_conference
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.conference.model import PlayoutConfig
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.protocol.pages.camera_body import camera_record
from vistel.render.config import live_delay
from vistel.render.stage.motion import MotionReader
from vistel.render.stage.stage import Stage
from vistel.wire import background, event_loop
from vistel.wire.topics import BY_NAME

MOST_MS = 120.0
FINDING_MS = 30.0
"""What finding the body in a picture takes on a machine that the target is meant for."""
BEGUN_S, SECONDS = 12.0, 40.0
"""Until the figure has the person's measures; for which it is watched then."""
WRIST = JOINT_INDEX["left_hand"]
_LAGS_MS = np.arange(0.0, 800.0)

Heights = list[tuple[int, float]]
"""Times [ns], and how high the wrist is then [m]."""


@dataclass
class _Found:
    """true: in the pictures; arrived: in motions as they come to another site; shown: as its renderer would show it, played out."""

    true: Heights = field(default_factory=Heights)
    arrived: Heights = field(default_factory=Heights)
    shown: Heights = field(default_factory=Heights)


def rows() -> Iterator[Row]:
    """Figures of a webcam without a browser."""
    found = event_loop.run(background.as_service("lag", _measure()))
    case = f"landmarks of a webcam's picture, {RATES['camera']:.0f} a second, to another site"
    arrived_ms, shown_ms = (float(np.median(lags_ms(found.true, heights))) for heights in (found.arrived, found.shown))
    yield Row("guest", case, "to the pose that arrives", "ms", arrived_ms)
    with_finding = f"to the pose that arrives, and {FINDING_MS:.0f} ms to find the body"
    yield Row("guest", case, with_finding, "ms", arrived_ms + FINDING_MS, target=at_most(MOST_MS))
    yield Row("guest", case, "to the pose that is shown, played out", "ms", shown_ms)


def lags_ms(true: Heights, followed: Heights) -> list[float]:
    """How late one follows the other, in each cycle of what is true that has been followed: the shift at which they agree best."""
    true_ns, true_m = (np.array(column, float) for column in zip(*true, strict=True))
    times_ns, m = (np.array(column, float) for column in zip(*followed, strict=True))
    out: list[float] = []
    cycle_ns = CYCLE / RATES["camera"] * 1e9
    for begin_ns, end_ns in pairwise(np.arange(true_ns[0] + 1e6 * _LAGS_MS[-1], true_ns[-1], cycle_ns)):
        within = (times_ns >= begin_ns) & (times_ns < end_ns)
        if within.sum() > CYCLE // 2:
            agree = [_agreement(np.interp(times_ns[within] - 1e6 * lag, true_ns, true_m), m[within]) for lag in _LAGS_MS]
            out.append(float(_LAGS_MS[int(np.argmax(agree))]))
    return out


def _agreement(a: np.ndarray, b: np.ndarray) -> float:
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b / max(1e-12, np.linalg.norm(a) * np.linalg.norm(b)))


def wrist_heights(samples: Iterable[Any], reader: MotionReader) -> Heights:
    """Of a figure, in motions as they arrive."""
    return [(s.received_ns, _height(posed.posture)) for s in samples for _, posed in reader.read(s.message)[-1:]]


def _height(posture: Posture) -> float:
    return float(pose_joints(standard_skeleton(), posture).position[WRIST, 1])


async def _measure() -> _Found:
    found = _Found()
    async with live_conference("lag", guests=1) as live, seated(live, 1) as light:
        with part("a webcam"):
            async with beside(_send(live, light, found)) as sending:
                await _watch(live, found)
                await sending
    return found


async def _send(live: LiveConference, light: LightGuest, found: _Found) -> None:
    person = raising_arms()
    camera = seen_by_camera(person)

    async def show(n: int) -> None:
        now_ns = live.clock.now_ns()
        await light.send("camera", camera_record(now_ns, camera[n % CYCLE], calibrating=n < BEGUN_S / 2 * RATES["camera"]))
        if n >= BEGUN_S * RATES["camera"]:
            found.true.append((now_ns, float(person[n % CYCLE].position[WRIST, 1])))

    await at_rate(live.clock, RATES["camera"], BEGUN_S + SECONDS, show)


async def _watch(live: LiveConference, found: _Found) -> None:
    stage, reader = Stage(live_delay(PlayoutConfig())), MotionReader()
    about = live.bus.subscribe(BY_NAME["participant"], polled=True)
    motions = live.bus.subscribe(BY_NAME["motion"], queue_all=True, polled=True, participant=guest(1))
    until_s = time.monotonic() + BEGUN_S + SECONDS
    while time.monotonic() < until_s:
        for sample in about.take():
            stage.receive_participant(sample.message)
        arrived = motions.take()
        for sample in arrived:
            stage.receive_motion(guest(1), sample.message, sample.received_ns)
        found.arrived += wrist_heights(arrived, reader)
        now_ns = live.clock.now_ns()
        found.shown += [(now_ns, _height(p.posture)) for p in stage.instant(now_ns).people if p.about.name == guest(1)]
        await asyncio.sleep(LOOK_S)
    about.close()
    motions.close()

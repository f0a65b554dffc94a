"""A guest's page in a browser whose camera is a film: how soon they are in the room, and how late their figure follows them."""

import asyncio
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.pages.chromium import ROOT, Page, browser, drawn_by, is_software
from benchmarks.pages.guests_live import token, with_guests
from benchmarks.pages.live_conference import LiveConference
from benchmarks.progress import part, skipped
from benchmarks.row import Row, at_most
from vistel.conference.model import Conference
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.protocol.pages.camera_body import BODY
from vistel.render.config import live_delay
from vistel.render.stage.stage import Stage
from vistel.wire import background, event_loop
from vistel.wire.topics import BY_NAME
from vistel_services.console import landmarks

sys.path.insert(0, str(ROOT / "tests" / "service"))
from guest_film import HIGH, LOW, RAISES, SITS, film, person, stills

ENTER_S = 15.0
"""Within which a guest is in the room, from the opening of the link [s]."""
WATCHED_S = 60.0
HELD_S = 6.0
"""For which the film's person holds the hands high, and then low: more than any browser needs for a picture."""
CALIBRATED_S = 12.0
"""Of the film, at its beginning: the person sits, and raises both hands."""
SIZE = (640, 400)
_WRIST = JOINT_INDEX["left_hand"]
_SEEN_WRIST = 3 * BODY.index("left_wrist") + 1
"""Where the height of the left wrist stands among what a camera sees."""
_LOOK_S = 0.004
_CAMERA = ("--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream")


@dataclass
class _Found:
    """entered_s: from the link to the page's own sight of the figure; moved_s: to its first motion at other sites; seen: times of
    pictures [ns] and the height of the wrist in them; posed: the same of the figure as another site shows it."""

    renderer: str = ""
    entered_s: float = 0.0
    moved_s: float = 0.0
    seen: list[tuple[int, float]] = field(default_factory=list[tuple[int, float]])
    posed: list[tuple[int, float]] = field(default_factory=list[tuple[int, float]])
    finding_ms: list[float] = field(default_factory=list[float])


def rows() -> Iterator[Row]:
    """Figures of one guest's page."""
    if not (landmarks.FOLDER / "landmarks/holistic.js").is_file():
        skipped("a guest's page", "npm's @mediapipe/holistic is not there (make web)")
        return
    found = event_loop.run(background.as_service("guest", _measure()))
    judged = not is_software(found.renderer)
    case = f"one guest's page, {SIZE[0]}x{SIZE[1]}, drawn by {found.renderer}"
    yield Row("guest", case, "link opened to moving in the room", "s", found.moved_s, target=at_most(ENTER_S), judged=judged)
    yield Row("guest", case, "the same, seen in the page itself", "s", found.entered_s, target=at_most(ENTER_S), judged=judged)
    late_ms = _late_ms(found)
    if not late_ms or not found.finding_ms:
        skipped("webcam to pose", "the browser found too few of the film's moves")
        return
    late, finding = float(np.median(late_ms)), float(np.median(found.finding_ms))
    yield Row("guest", f"{case}, {len(late_ms)} moves", "webcam picture to remote pose, p50", "ms", late)
    yield Row("guest", f"{case}, {len(late_ms)} moves", "of that, finding the body", "ms", finding)
    yield Row("guest", f"{case}, {len(late_ms)} moves", "all else", "ms", late - finding)


def _late_ms(found: _Found) -> list[float]:
    """From the first picture in which the hands are on the other side, to the figure's hand half-way there, of each move."""
    out: list[float] = []
    (_, before), *rest = _sides(found.seen)
    posed = _sides(found.posed)
    for t_ns, side in rest:
        if side != before:
            before = side
            followed = next((p_ns for p_ns, there in posed if p_ns > t_ns and there == side), None)
            if followed is not None and followed - t_ns < 0.8 * HELD_S * 1e9:
                out.append((followed - t_ns) * 1e-6)
    return out


def _sides(heights: list[tuple[int, float]]) -> list[tuple[int, bool]]:
    """Times, and whether something is above the middle of its way."""
    low, high = np.percentile([h for _, h in heights], (10, 90))
    return [(t_ns, h > 0.5 * (low + high)) for t_ns, h in heights]


async def _measure() -> _Found:
    found = _Found()
    with tempfile.TemporaryDirectory(prefix="vistel-") as name:
        folder = Path(name)
        with part("the film"):
            sits, raises, low, high = stills(person("carla"), (SITS, RAISES, LOW, HIGH))
            moves = [(low, HELD_S), (high, HELD_S)] * round(0.5 * WATCHED_S / HELD_S)
            shown = film(folder / "film.mjpeg", [(sits, 0.5 * CALIBRATED_S), (raises, 0.5 * CALIBRATED_S), *moves])
        async with with_guests() as live, browser(folder, *_CAMERA, f"--use-file-for-fake-video-capture={shown}") as tab:
            with part("a guest enters"):
                await _enter(live, tab, found)
            with part("a guest moves"):
                await _move(live, tab, found)
    return found


async def _enter(live: LiveConference, tab: Page, found: _Found) -> None:
    motions = live.bus.subscribe(BY_NAME["motion"], polled=True, participant="guest-1")
    moved_s: list[float] = []

    async def wait() -> None:
        while not motions.take():
            await asyncio.sleep(_LOOK_S)
        moved_s.append(time.monotonic())

    waiting = asyncio.create_task(wait())
    began = time.monotonic()
    await tab.open(f"{live.url}join#{token(live, 1)}", *SIZE)
    await tab.until("document.querySelector('.people button[aria-current=true]')")
    await tab.click(".people button[aria-current=true]")
    await tab.until("window.guest.me() === 'guest-1'")
    found.entered_s = time.monotonic() - began
    await waiting
    found.moved_s = moved_s[0] - began
    found.renderer = await drawn_by(tab)
    motions.close()


async def _move(live: LiveConference, tab: Page, found: _Found) -> None:
    await tab.click("#camera")
    await tab.until("window.guest.camera.state === 'on'")
    stage = Stage(live_delay(Conference.model_validate({"name": "c", "sites": [{"name": "a"}]}).playout))
    about = live.bus.subscribe(BY_NAME["participant"], polled=True)
    motions = live.bus.subscribe(BY_NAME["motion"], queue_all=True, polled=True, participant="guest-1")
    cameras = live.bus.subscribe(BY_NAME["camera_body"], queue_all=True, polled=True)
    skeleton, until_s, asked_s = standard_skeleton(), time.monotonic() + CALIBRATED_S + WATCHED_S, 0.0
    while time.monotonic() < until_s:
        for sample in about.take():
            stage.receive_participant(sample.message)
        for sample in motions.take():
            stage.receive_motion("guest-1", sample.message, sample.received_ns)
        found.seen += [(s.message.picture_t_ns, float(s.message.body[_SEEN_WRIST])) for s in cameras.take() if len(s.message.body)]
        now_ns = live.clock.now_ns()
        people = {p.about.name: p.posture for p in stage.instant(now_ns).people}
        if "guest-1" in people:
            found.posed.append((now_ns, float(pose_joints(skeleton, people["guest-1"]).position[_WRIST, 1])))
        if time.monotonic() - asked_s > 1.0:
            asked_s = time.monotonic()
            if took := await tab.value("window.guest.camera.tookMs"):
                found.finding_ms.append(float(took))
        await asyncio.sleep(_LOOK_S)

"""A guest's page in a browser whose camera is a film: how soon they are in the room, and how late their figure follows them."""

import asyncio
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.pages.chromium import ROOT, Page, browser, drawn_by, missing
from benchmarks.pages.guest_lag import FINDING_MS, MOST_MS, Heights, wrist_heights
from benchmarks.pages.guest_seats import LOOK_S, link_to
from benchmarks.pages.live_conference import LiveConference, beside, guest, live_conference, until_moving
from benchmarks.progress import part, skipped
from benchmarks.row import Row, at_most
from vistel.protocol.pages.camera_body import BODY
from vistel.render.stage.motion import MotionReader
from vistel.wire import background, event_loop
from vistel.wire.topics import BY_NAME
from vistel_services.console import landmarks

sys.path.insert(0, str(ROOT / "tests" / "service"))
from guest_film import HIGH, LOW, RAISES, SITS, film, person, stills

ENTER_S = 15.0
"""Within which a guest is in the room, from the opening of the link [s]."""
OPENINGS = 3
"""Of a link, each in a browser that has never been there."""
HELD_S = 20.0
"""For which the film's person holds the hands high, and then low: more than two pictures take without a graphics card [s]."""
MOVES = 6
CALIBRATED_S = 30.0
"""Of the film, at its beginning: the person sits, and raises both hands [s]."""
SIZE = (640, 400)
_PATIENCE_S = 120.0
_SEEN_WRIST = 3 * BODY.index("left_wrist") + 1
"""Where the height of the left wrist stands among what a camera sees."""
_CAMERA = ("--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream")


@dataclass
class _Found:
    """moved_s: from the link to the first motion at other sites, entered_s: to the page's own sight of the figure, of each opening;
    seen: times of pictures and how high the wrist is in them, in the camera's units; posed: of the figure, as it arrives elsewhere;
    finding_ms: what it took to find the body in pictures."""

    renderer: str = ""
    moved_s: list[float] = field(default_factory=list[float])
    entered_s: list[float] = field(default_factory=list[float])
    seen: Heights = field(default_factory=Heights)
    posed: Heights = field(default_factory=Heights)
    finding_ms: list[float] = field(default_factory=list[float])


def rows() -> Iterator[Row]:
    """Figures of one guest's page."""
    if why := missing():
        skipped("a guest's page", why)
        return
    camera = (landmarks.FOLDER / "landmarks/holistic.js").is_file()
    if not camera:
        skipped("a guest's webcam", "npm's @mediapipe/holistic is not there (make web)")
    found = event_loop.run(background.as_service("guest", _measure(camera)))
    case = f"one guest's page, {SIZE[0]}x{SIZE[1]}, a new browser, drawn by {found.renderer}"
    yield Row("guest", case, "link opened to figure in the room", "s", float(np.median(found.moved_s)), target=at_most(ENTER_S))
    yield Row("guest", case, "the same, seen in the page itself", "s", float(np.median(found.entered_s)), target=at_most(ENTER_S))
    if camera:
        yield from _of_camera(found, case)


def _of_camera(found: _Found, case: str) -> Iterator[Row]:
    late_ms = follows_ms(found.seen, found.posed)
    if not late_ms or not found.finding_ms:
        skipped("a webcam's picture to the pose", "the browser found too few of the film's moves")
        return
    late, finding = float(np.median(late_ms)), float(np.median(found.finding_ms))
    case = f"{case}, {len(late_ms)} moves"
    target = at_most(MOST_MS)
    yield Row("guest", case, "webcam picture to remote pose", "ms", late, target=target, judged=finding <= FINDING_MS)
    yield Row("guest", case, "of that, finding the body", "ms", finding)
    yield Row("guest", case, "all else", "ms", late - finding)


def follows_ms(seen: Heights, posed: Heights) -> list[float]:
    """From the first picture in which the hands are on the other side, to the figure's hand half-way there, of each move that the
    figure follows before the next one."""
    out: list[float] = []
    moves, follows = _changes(seen), _changes(posed)
    for (t_ns, side), (end_ns, _) in pairwise([*moves, (2**63, True)]):
        followed = next((p_ns for p_ns, there in follows if t_ns < p_ns < end_ns and there == side), None)
        if followed is not None:
            out.append((followed - t_ns) * 1e-6)
    return out


def _changes(heights: Heights) -> list[tuple[int, bool]]:
    """When something comes to the other side of the middle of its way, and whether it is above it then."""
    if not heights:
        return []
    middle = 0.5 * sum(np.percentile([h for _, h in heights], (10, 90)))
    return [(t_ns, h > middle) for (_, before), (t_ns, h) in pairwise(heights) if (h > middle) != (before > middle)]


async def _measure(camera: bool) -> _Found:
    found = _Found()
    with tempfile.TemporaryDirectory(prefix="vistel-") as name:
        folder, more = Path(name), _CAMERA
        if camera:
            with part("the film"):
                more = (*_CAMERA, f"--use-file-for-fake-video-capture={_film(folder)}")
        async with live_conference("guest", guests=OPENINGS) as live:
            with part("links opened", OPENINGS) as done:
                for n in range(1, OPENINGS + 1):
                    async with browser(folder / str(n), *more) as tab:
                        await _enter(live, tab, n, found)
                        done()
                        if camera and n == OPENINGS:
                            with part("a webcam"):
                                await _move(live, tab, n, found)
    return found


def _film(folder: Path) -> Path:
    sits, raises, low, high = stills(person("carla"), (SITS, RAISES, LOW, HIGH))
    moves = [(low, HELD_S), (high, HELD_S)]
    return film(folder / "film.mjpeg", [(sits, 0.5 * CALIBRATED_S), (raises, 0.5 * CALIBRATED_S), *moves])


async def _enter(live: LiveConference, tab: Page, number: int, found: _Found) -> None:
    began = time.monotonic()
    async with beside(_moving(live, number)) as moving, asyncio.timeout(_PATIENCE_S):
        await tab.open(f"{live.url}join#{link_to(live, number)}", *SIZE)
        await tab.until("document.querySelector('.people button[aria-current=true]')")
        await tab.click(".people button[aria-current=true]")
        await tab.until(f"window.guest?.me() === {guest(number)!r}")
        found.entered_s.append(time.monotonic() - began)
        found.moved_s.append(await moving - began)
    found.renderer = await drawn_by(tab)


async def _moving(live: LiveConference, number: int) -> float:
    """When a guest's figure moves at other sites."""
    await until_moving(live.bus, {guest(number)})
    return time.monotonic()


async def _move(live: LiveConference, tab: Page, number: int, found: _Found) -> None:
    async with asyncio.timeout(_PATIENCE_S):
        await tab.click("#camera")
        await tab.until("window.guest.camera.state === 'on'")
    motions = live.bus.subscribe(BY_NAME["motion"], queue_all=True, polled=True, participant=guest(number))
    cameras = live.bus.subscribe(BY_NAME["camera_body"], queue_all=True, polled=True)
    reader, until_s, asked_s = MotionReader(), time.monotonic() + CALIBRATED_S + MOVES * HELD_S, 0.0
    while time.monotonic() < until_s:
        found.posed += wrist_heights(motions.take(), reader)
        seen = [sample.message for sample in cameras.take()]
        found.seen += [(m.picture_t_ns, float(m.body[_SEEN_WRIST])) for m in seen if m.body and not m.calibrating]
        if time.monotonic() - asked_s > 1.0:
            asked_s = time.monotonic()
            if took := await tab.value("window.guest.camera.tookMs"):
                found.finding_ms.append(float(took))
        await asyncio.sleep(LOOK_S)
    motions.close()
    cameras.close()

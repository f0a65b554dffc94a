"""Guests of a conference that goes on: what ten of them cost, how soon a slide is there to be read, and whether ink is lost."""

import asyncio
import contextlib
import io
import json
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field

import aiohttp
import numpy as np
import psutil
from PIL import Image, ImageDraw

from benchmarks.pages.light_guests import at_rate, entered
from benchmarks.pages.live_conference import PEOPLE, LiveConference, live_conference
from benchmarks.progress import part
from benchmarks.row import NONE_AT_ALL, Row, at_least, at_most
from vistel.conference.invitations import Invitation, digest_of_token, invite
from vistel.conference.model import Conference
from vistel.render.config import live_delay
from vistel.render.stage.stage import Stage
from vistel.session.models import RoomDeliveries
from vistel.space.boards.stroke import unpacked
from vistel.space.files.model import Polymesh
from vistel.wire import background, event_loop
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel.wire.zenoh.bus import ZenohBus

GUESTS = 10
SECONDS = 15.0
"""For which ten guests are measured."""
SLIDES = 5
SLIDE_SIZE = (1600, 900)
STROKES, HANDS, MINUTE_S = 200, 2, 60.0
PARTS, POINTS = 3, 10
"""Of a stroke: so many messages, each of so many points."""
_LOOK_S = 0.01
_LAST_S = 10.0
"""In which the last stroke is to come."""
_HOUR_NS = 3_600_000_000_000
BOARD = "board"
SEATS = "".join(
    f'[[sites.participants]]\nname = "guest-{n}"\nguest = true\nheight = 1.71\navatar = "builtin:person=carla"\n'
    for n in range(1, GUESTS + 1)
)
MORE = f'[[room.things]]\nid = "{BOARD}"\nname = "board"\nshape = "board"\nat = [1.5, 1.5]\n[[sites]]\nname = "guests"\n{SEATS}'
NODE = "guests/capture"


@dataclass
class _Found:
    """slides_s: from the file being chosen to its picture at every site."""

    gateway: float = 0.0
    figures: float = 0.0
    many: dict[str, float] = field(default_factory=dict[str, float])
    motions_per_s: float = 0.0
    slides_s: list[float] = field(default_factory=list[float])
    sent: int = 0
    lost: int = 0
    took_s: float = 0.0


@contextlib.asynccontextmanager
async def with_guests() -> AsyncIterator[LiveConference]:
    """A conference of three live sites and one for guests."""
    async with live_conference("guests", MORE, (NODE,), GUESTS) as live:
        yield live


def token(live: LiveConference, number: int) -> str:
    """Of a new link to a guest's seat."""
    made = f"a-token-of-a-benchmark-guest-{number}"
    until_ns = live.clock.now_ns() + _HOUR_NS
    invite(live.folder, Invitation(f"guest-{number}", f"Guest {number}", "builtin:person=carla", digest_of_token(made), until_ns))
    return made


def rows() -> Iterator[Row]:
    """Figures of guests without a browser."""
    found = event_loop.run(background.as_service("guests", _measure()))
    case = f"{GUESTS} guests with mouse, camera and voice, whose process takes {found.many['load']:.2f} cores"
    yield Row("guest", case, "gateway", "cores", found.gateway, target=at_most(1.0))
    yield Row("guest", case, "their postures", "cores", found.figures)
    yield Row("guest", case, "motions of each", "1/s", found.motions_per_s, target=at_least(50.0))
    yield Row("guest", case, "frames to each, the least", "1/s", found.many["frames_per_s"])
    up = found.many["kbit_s"]
    yield Row("guest", case, "up-link of body, hands, face, voice", "kbit/s", up, target=at_most(96.0))
    slides = f"slides of {SLIDE_SIZE[0]}x{SLIDE_SIZE[1]} at {len(PEOPLE)} sites"
    yield Row("guest", slides, "chosen to whole everywhere, worst", "s", max(found.slides_s), target=at_most(2.0))
    yield Row("guest", slides, "the same, median", "s", np.median(found.slides_s))
    ink = f"{STROKES} strokes of {HANDS} guests in {found.took_s:.0f} s"
    yield Row("guest", ink, "points sent", "points", found.sent)
    yield Row("guest", ink, "points lost", "points", found.lost, target=NONE_AT_ALL)


async def _measure() -> _Found:
    found = _Found()
    async with with_guests() as live:
        with part(f"{GUESTS} guests"):
            await _many(live, found)
        with part("slides"):
            await _slides(live, found)
        with part("strokes"):
            await _strokes(live, found)
    return found


async def _many(live: LiveConference, found: _Found) -> None:
    tokens = [token(live, n) for n in range(1, GUESTS + 1)]
    command = [sys.executable, "-m", "benchmarks.pages.light_guests", live.url, str(SECONDS + 4.0), *tokens]
    process = await asyncio.create_subprocess_exec(*command, stdout=asyncio.subprocess.PIPE)
    motions = live.bus.subscribe(BY_NAME["motion"], queue_all=True, polled=True)
    arrived = set[str]()
    while len(arrived) < GUESTS:
        if process.returncode is not None:
            raise RuntimeError("the guests ended")
        arrived |= {s.names["participant"] for s in motions.take() if s.names["participant"].startswith("guest-")}
        await asyncio.sleep(_LOOK_S)
    await asyncio.sleep(2.0)
    motions.take()
    both = [psutil.Process(live.gateway.pid), psutil.Process(live.hosts[NODE])]
    before, began = [_used(p) for p in both], time.monotonic()
    await asyncio.sleep(SECONDS - 2.0)
    took = time.monotonic() - began
    found.gateway, found.figures = ((_used(p) - b) / took for p, b in zip(both, before, strict=True))
    count = sum(s.names["participant"].startswith("guest-") for s in motions.take())
    found.motions_per_s = count / took / GUESTS
    motions.close()
    said, _ = await process.communicate()
    if process.returncode:
        raise RuntimeError(f"the guests ended with {process.returncode}")
    found.many = json.loads(said)


def _used(process: psutil.Process) -> float:
    times = process.cpu_times()
    return times.user + times.system


class _Site:
    """What a site's renderer knows of the things and of the pictures on them; made by `opened`."""

    def __init__(self, bus: ZenohBus, live: LiveConference) -> None:
        self._bus, self._clock = bus, live.clock
        self._stage = Stage(live_delay(Conference.model_validate({"name": "c", "sites": [{"name": "a"}]}).playout))
        self._world = WorldListener(bus, live.clock)
        self._models = dict[str, Polymesh]()
        self._deliveries = RoomDeliveries(bus, live.clock, self._models)

    def reads(self, name: str) -> bool:
        """Whether a panel of this name is here with its picture."""
        for now, received_ns in self._world.take():
            self._stage.receive_world(now, received_ns)
        self._deliveries.show(self._stage.pages)
        things = self._stage.instant(self._clock.now_ns()).things
        shown = [t for t in things.values() if t.pages is not None and t.name == name]
        return bool(shown) and all(look.model in self._models for look in shown[0].looks)

    async def close(self) -> None:
        self._deliveries.close()
        self._world.close()
        await self._bus.close()


async def _slides(live: LiveConference, found: _Found) -> None:
    buses = [await ZenohBus.open(conference="guests", site=site, clock=live.clock, endpoints=[live.endpoint]) for site in PEOPLE]
    sites = [_Site(bus, live) for bus in buses]
    shown = token(live, 1)
    async with entered(live.url, shown) as guest, aiohttp.ClientSession() as session:
        acting = asyncio.create_task(guest.listen())
        await _until(lambda: all(not site.reads("") for site in sites), 5.0, "the sites")
        await asyncio.sleep(3.0)  # the guest's figure is in the room
        for n in range(SLIDES):
            name, data = f"slide {n}", _slide(n)
            began = time.monotonic()
            headers = {"Authorization": f"Bearer {shown}"}
            async with session.post(f"{live.url}guest/page", data=data, headers=headers) as answer:
                if answer.status != 200:
                    raise RuntimeError(f"a slide was refused: {await answer.text()}")
            await guest.socket.send_json({"show": name})
            await _until(lambda name=name: min(site.reads(name) for site in sites), 60.0, f"{name} at all sites")
            found.slides_s.append(time.monotonic() - began)
        acting.cancel()
    for site in sites:
        await site.close()


def _slide(number: int) -> bytes:
    """A page nobody has seen: text on white."""
    picture = Image.new("RGB", SLIDE_SIZE, "white")
    draw = ImageDraw.Draw(picture)
    for line in range(16):
        draw.text(
            (80, 40 + 52 * line), f"{time.time_ns()} slide {number}, line {line}: what is shown is read", "black", font_size=36
        )
    out = io.BytesIO()
    picture.save(out, "png")
    return out.getvalue()


async def _strokes(live: LiveConference, found: _Found) -> None:
    listener = WorldListener(live.bus, live.clock)
    rng = np.random.default_rng(3)
    wanted: dict[str, list[tuple[int, int]]] = {}

    async def write(number: int) -> None:
        async with entered(live.url, token(live, number)) as guest:
            listening = asyncio.create_task(guest.listen())
            await asyncio.sleep(3.0)  # the guest's figure is in the room

            async def part_of(n: int) -> None:
                stroke, part_number = divmod(n, PARTS)
                name = f"{number} {stroke}"
                points = wanted.setdefault(name, [(int(rng.integers(300, 3000)), int(rng.integers(300, 2000)))])
                first = part_number == 0
                new: list[tuple[int, int]] = []
                for _ in range(POINTS - first):
                    x, y = (new or points)[-1]
                    new.append((x + int(rng.integers(4, 12)), y + int(rng.integers(-8, 9))))
                said = [*points, *new] if first else new
                points += new
                flat = [k for point in said for k in point]
                await guest.socket.send_json({"draw": flat, "board": BOARD, "stroke": name, "colour": "#222222"})

            rate = PARTS * STROKES / HANDS / MINUTE_S
            await at_rate(rate, time.monotonic() + MINUTE_S - 1e-3, part_of)
            await asyncio.sleep(3.0)
            listening.cancel()

    written: dict[str, set[tuple[int, int]]] = {}

    def look() -> bool:
        for now, _ in listener.take():
            for stroke in now.strokes.values():
                written[stroke.id] = {(int(x), int(y)) for x, y in unpacked(stroke.ink)}
        return all(set(points) <= written.get(name, set()) for name, points in wanted.items())

    await asyncio.gather(*(write(n) for n in range(1, HANDS + 1)))
    found.took_s = MINUTE_S
    with contextlib.suppress(RuntimeError):
        await _until(look, _LAST_S, "the last stroke")
    listener.close()
    found.sent = sum(map(len, wanted.values()))
    found.lost = sum(point not in written.get(name, ()) for name, points in wanted.items() for point in points)


async def _until(holds: Callable[[], object], most_s: float, what: str) -> None:
    """Raises RuntimeError where it takes longer."""
    until_s = time.monotonic() + most_s
    while not holds():
        if time.monotonic() > until_s:
            raise RuntimeError(f"{what}: not within {most_s:.0f} s")
        await asyncio.sleep(_LOOK_S)

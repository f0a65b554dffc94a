"""How soon a slide that a guest shows is there to be read at every site: its picture decoded, on the panel that is shown. No site
draws here."""

import contextlib
import io
import time
from collections.abc import AsyncGenerator, Iterator

import aiohttp
import numpy as np
from PIL import Image, ImageDraw

from benchmarks.pages.guest_seats import link_to, seated, until
from benchmarks.pages.live_conference import PEOPLE, LiveConference, live_conference
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.conference.model import PlayoutConfig
from vistel.render.config import live_delay
from vistel.render.stage.stage import Stage
from vistel.session.models import RoomDeliveries
from vistel.space.files.model import Polymesh
from vistel.wire import background, event_loop
from vistel.wire.clock import Clock
from vistel.wire.world.listener import WorldListener
from vistel.wire.zenoh.bus import ZenohBus

SLIDES = 5
SIZE = (1600, 900)
READABLE_S = 2.0
_MOST_S = 60.0
"""After which a slide is given up [s]."""


def rows() -> Iterator[Row]:
    """Figures of slides."""
    took = event_loop.run(background.as_service("slides", _measure()))
    case = f"{SLIDES} slides of {SIZE[0]}x{SIZE[1]} by a guest, read at {len(PEOPLE)} sites that do not draw"
    yield Row("guest", case, "chosen to readable everywhere, worst", "s", max(took), target=at_most(READABLE_S))
    yield Row("guest", case, "the same, median", "s", float(np.median(took)))


class _Site:
    """What a site's renderer knows of panels and of the pictures on them; made by `_opened`."""

    def __init__(self, bus: ZenohBus, clock: Clock) -> None:
        self._clock = clock
        self._stage = Stage(live_delay(PlayoutConfig()))
        self._world = WorldListener(bus, clock)
        self._models = dict[str, Polymesh]()
        self._deliveries = RoomDeliveries(bus, clock, self._models)

    def reads(self, name: str) -> bool:
        """Whether a panel of this name is shown with its picture."""
        for now, received_ns in self._world.take():
            self._stage.receive_world(now, received_ns)
        self._deliveries.show(self._stage.pages)
        things = self._stage.instant(self._clock.now_ns()).things.values()
        panels = [thing for thing in things if thing.pages is not None and thing.name == name]
        return bool(panels) and all(look.model in self._models for panel in panels for look in panel.looks)

    def close(self) -> None:
        self._deliveries.close()
        self._world.close()


@contextlib.asynccontextmanager
async def _opened(live: LiveConference, site: str) -> AsyncGenerator[_Site]:
    bus = await ZenohBus.open(conference="slides", site=site, clock=live.clock, endpoints=[live.endpoint])
    try:
        with contextlib.closing(_Site(bus, live.clock)) as opened:
            yield opened
    finally:
        await bus.close()


async def _measure() -> list[float]:
    """Seconds from each slide's choice."""
    async with live_conference("slides", guests=1) as live, contextlib.AsyncExitStack() as stack:
        sites = [await stack.enter_async_context(_opened(live, site)) for site in PEOPLE]
        token = link_to(live, 1)
        guest = await stack.enter_async_context(seated(live, 1, token))
        session = await stack.enter_async_context(aiohttp.ClientSession(headers={"Authorization": f"Bearer {token}"}))
        took: list[float] = []
        with part("slides", SLIDES) as done:
            for n in range(SLIDES):
                name, data = f"slide {n}", _slide(n)
                began = time.monotonic()
                async with session.post(f"{live.url}guest/page", data=data) as answer:
                    if answer.status != 200:
                        raise RuntimeError(f"a slide was refused: {await answer.text()}")
                await guest.socket.send_json({"show": name})

                def read(name: str = name) -> bool:
                    if guest.refused:
                        raise RuntimeError(f"{name} was refused: {guest.refused[0]}")
                    return min([site.reads(name) for site in sites])

                await until(read, _MOST_S, f"{name} at all sites")
                took.append(time.monotonic() - began)
                await until(lambda: guest.panels, _MOST_S, "the page is told of the panel")
                await guest.socket.send_json({"away": True})  # nobody may have more than four
                await until(lambda: not guest.panels, _MOST_S, f"{name} away")
                done()
        return took


def _slide(number: int) -> bytes:
    """A page nobody has seen: text on white, PNG."""
    picture = Image.new("RGB", SIZE, "white")
    draw = ImageDraw.Draw(picture)
    for line in range(16):
        said = f"{time.time_ns()} slide {number}, line {line}: what is shown is read"
        draw.text((80, 40 + 52 * line), said, "black", font_size=36)
    out = io.BytesIO()
    picture.save(out, "png")
    return out.getvalue()

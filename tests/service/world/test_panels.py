"""A PDF that somebody shows stands on a panel at all sites, for late joiners, after a crash of the world, and in a log."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from PIL import Image
from world_site import TICK_NS, WorldSite, scenario

from vistel.messages.world.verify import verify
from vistel.render.film.pages import RecordedPages
from vistel.render.stage.stage import Stage
from vistel.session import models
from vistel.session.asking import Answer, Asker
from vistel.session.models import RoomDeliveries
from vistel.session.showing import Page, page_of, show
from vistel.space.actions import PutAway, TurnPage
from vistel.space.files.model import Polymesh
from vistel.space.pages.read import pages_of
from vistel.space.pages.sheet import sheet_of, unpacked_page
from vistel.wire.log import LogRecord
from vistel.wire.memory_bus import MemoryBus
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel_cli.examples.slides import SLIDES, pdf

T = TypeVar("T")


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> list[Page]:
    """Three pages of a PDF, as they travel."""
    pytest.importorskip("pypdfium2", reason="pypdfium2 is not installed")
    path = tmp_path_factory.mktemp("slides") / "slides.pdf"
    path.write_bytes(pdf(SLIDES))
    return [page_of(image) for image in pages_of(path)]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is kept on this machine from before."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


class Beholder:
    """What a site's renderer knows of things and pages."""

    def __init__(self, bus: MemoryBus, site: WorldSite) -> None:
        self.models: dict[str, Polymesh] = {}
        self.stage, self._listener = Stage(0), WorldListener(bus, site.clock)
        self._deliveries = RoomDeliveries(bus, site.clock, self.models)

    def look(self) -> None:
        for now, received_ns in self._listener.take():
            self.stage.receive_world(now, received_ns)
        self._deliveries.want(self.stage.looks - self.stage.pages)
        self._deliveries.show(self.stage.pages)

    def shows(self) -> str:
        """The digest of what a panel shows, once it can be drawn; empty before."""
        self.look()
        panel = next((t for t in self.stage.instant(0).things.values() if t.pages), None)
        return panel.looks[0].model if panel is not None and panel.looks[0].model in self.models else ""

    def close(self) -> None:
        self._listener.close()
        self._deliveries.close()


async def going_on(site: WorldSite, holds: Callable[[], object]) -> None:
    """Let time pass until it holds; what threads do takes some of the machine's."""
    while not holds():
        await site.play(TICK_NS * 1e-9)
        await asyncio.sleep(0.001)  # a thread decodes


async def meanwhile(site: WorldSite, asked: Awaitable[T]) -> T:
    """The result of what somebody asks while the meeting goes on."""
    task = asyncio.ensure_future(asked)
    await going_on(site, task.done)
    return task.result()


async def shown(site: WorldSite, pages: list[Page]) -> Answer:
    """Aiko shows pages, from a program that ends then."""
    bus = site.network.bus("demo", "tokyo", site.clock)
    asker = Asker(bus, site.clock, "aiko")
    answer = await meanwhile(site, show(bus, site.clock, asker, pages, "slides"))
    asker.close()
    await bus.close()
    return answer


async def asks(site: WorldSite, action: Any, who: str = "aiko") -> Answer:
    asker = Asker(site.buses[who], site.clock, who)
    answer = await meanwhile(site, asker.ask(action))
    asker.close()
    return answer


def test_every_site_sees_the_same_page_and_the_next_one_is_there_before_it_is_turned(tmp_path: Path, pages: list[Page]) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        there = Beholder(site.network.bus("demo", "paris", site.clock), site)
        answer = await shown(site, pages)
        assert answer.done and len(answer.things) == 1, answer.reason
        await going_on(site, there.shows)
        assert there.shows() == pages[0].model
        (material,) = there.models[pages[0].model].materials
        assert np.array_equal(material.picture, unpacked_page(pages[0].data))
        await going_on(site, lambda: there.look() or pages[1].model in there.models)
        assert (await asks(site, TurnPage(by=1.0), "bruno")).done, "whoever is in the room may turn a page"
        await going_on(site, lambda: there.shows() == pages[1].model)
        assert (await asks(site, PutAway())).done
        await going_on(site, lambda: not there.shows())
        there.close()

    site = scenario(tmp_path, play)
    report = verify(site.log)
    assert report.equal and report.difference == "", "the room of a log is computed anew, bit for bit"


def test_who_comes_late_gets_pages_from_the_world_when_whoever_showed_them_has_gone(
    tmp_path: Path, pages: list[Page], monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        await shown(site, pages)
        monkeypatch.setattr(models, "kept_model", lambda digest, pictures: None)  # another machine
        late = Beholder(site.network.bus("demo", "lagos", site.clock), site)
        await going_on(site, late.shows)
        assert late.shows() == pages[0].model
        late.close()

    scenario(tmp_path, play)


def test_a_world_that_is_killed_comes_back_with_panel_and_page(tmp_path: Path, pages: list[Page]) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        await shown(site, pages)
        await asks(site, TurnPage(page=3.0))
        await site.play(2.5)
        await site.kill()
        await site.start()
        there = Beholder(site.network.bus("demo", "paris", site.clock), site)
        await going_on(site, there.shows)
        assert there.shows() == pages[2].model
        there.close()

    scenario(tmp_path, play)


def test_a_page_that_nobody_has_keeps_no_other_one_waiting(tmp_path: Path, pages: list[Page]) -> None:
    async def play(site: WorldSite) -> None:
        await site.play(0.3)
        there = Beholder(site.network.bus("demo", "paris", site.clock), site)
        missing = [Page(pages[0].data, "0" * 32, 1.0)]
        assert not (await shown(site, missing)).done, "the world has another picture than is said"
        assert (await shown(site, pages)).done
        await going_on(site, there.shows)
        there.close()

    scenario(tmp_path, play)


def test_a_panel_shows_what_the_log_holds(pages: list[Page]) -> None:
    from vistel.wire.parcels import digest_of, parts_of

    recorded = RecordedPages({})
    topic = BY_NAME["picture_part"]
    for page in pages:
        for name, part in parts_of(page.data):
            names = {"conference": "demo", "site": "tokyo", "picture": digest_of(page.data), "part": name}
            recorded.receive(LogRecord(topic, topic.format(**names), names, part, 0, 0))
    assert {*recorded} == {p.model for p in pages}
    assert recorded[pages[2].model].digest == pages[2].model


def test_a_transparent_picture_is_on_white_and_a_photograph_gets_small_enough(tmp_path: Path) -> None:
    clear = Image.new("RGBA", (40, 20), (0, 0, 0, 0))
    clear.save(tmp_path / "clear.png")
    (page,) = [page_of(image) for image in pages_of(tmp_path / "clear.png")]
    assert unpacked_page(page.data).min() == 255
    noise = Image.fromarray(np.random.default_rng(0).integers(0, 256, (1500, 2400, 3)).astype(np.uint8))
    noise.save(tmp_path / "noise.png")
    (page,) = [page_of(image) for image in pages_of(tmp_path / "noise.png")]
    assert len(page.data) <= 3 << 20
    assert page.aspect == pytest.approx(1.6, abs=0.01)
    assert page.model == sheet_of(unpacked_page(page.data)).digest

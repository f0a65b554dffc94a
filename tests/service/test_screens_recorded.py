"""What somebody shows live is seen at its moment: in a replay's page, also after going back, and in films from any moment on."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Page, page
from PIL import Image
from recorded_meeting import written
from screen_stream import plain, stream_of
from served_log import SOFTWARE_GL, run, served
from world_site import WorldSite, scenario

from vistel.protocol.pages.screen_parts import parts_of
from vistel.render.film.film import instants, records_of
from vistel.session.asking import Asker
from vistel.session.showing import page_of
from vistel.space.actions import Present
from vistel.wire.log import LogReader
from vistel.wire.parcels import digest_of, send_parcel
from vistel.wire.topics import BY_NAME
from vistel_services.console import bundle

COLOURS = {"green": (20, 170, 60), "magenta": (210, 30, 200), "cyan": (20, 190, 220)}
"""Of which nothing else in the room is."""
EACH_S = 3.0
"""Each colour is shown for so long."""


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    """A log in which Aiko has a panel put up and shows three colours live, one after the other; when she begins, in it [s]."""
    folder = tmp_path_factory.mktemp("shown")
    card = page_of(Image.new("RGB", (320, 180), (48, 54, 60)))
    rate = 10
    pictures = [plain(colour) for colour in COLOURS.values() for _ in range(round(rate * EACH_S))]
    more: list[tuple[str, dict[str, str], Any, int]] = []
    begun: list[int] = []

    async def play(site: WorldSite) -> None:
        readers = [
            site.network.bus("demo", "hub", site.clock).subscribe(BY_NAME[n], queue_all=True) for n in ("picture_part", "screen")
        ]
        await site.play(0.3)
        aiko = site.buses["aiko"]
        await play_while(
            site,
            send_parcel(
                card.data,
                lambda name: aiko.publish(BY_NAME["picture_part"], picture=digest_of(card.data), part=name),
                site.clock,
                "show",
            ),
        )
        asker = Asker(aiko, site.clock, "aiko")
        answer = await play_while(site, asker.ask(Present((card.model,), card.aspect, "Screen of Aiko", True)))
        assert answer.done, answer.reason
        await site.play(1.0)
        begun.append(site.clock.now_ns())
        for picture in stream_of("vp8", pictures):
            for part in parts_of(picture):
                aiko.publish(BY_NAME["screen"], participant="aiko").put(part)
            await site.play(1.0 / rate)
        for reader in readers:
            more.extend((s.topic.name, s.names, s.message, s.received_ns) for s in reader.take())

    async def play_while(site: WorldSite, asked: Any) -> Any:
        task = asyncio.ensure_future(asked)
        while not task.done():
            await site.play(1.0 / 60)
            await asyncio.sleep(0.001)  # a thread decodes
        return task.result()

    site = scenario(folder, play)
    log = written(sorted([*site.log, *more], key=lambda record: record[3]), folder / "conference.mcap")
    return log, (begun[0] - LogReader(log).begin_ns) * 1e-9


def share(picture: np.ndarray, name: str) -> float:
    """Of a picture that is of about this colour, as bright as a panel's page is."""
    away = np.abs(picture.astype(int) - 0.85 * np.array(COLOURS[name])).max(axis=-1)
    return float((away < 45).mean())


def test_a_film_that_begins_at_any_moment_shows_what_was_shown_then(shown: tuple[Path, float]) -> None:
    reader, begun_s = LogReader(shown[0]), shown[1]
    for n, colour in list(enumerate(COLOURS.values()))[1:]:
        for at_s in n * EACH_S + np.arange(0.5, EACH_S, 0.5):
            begin_ns = reader.begin_ns + round((begun_s + at_s) * 1e9)
            end_ns = begin_ns + 10**9
            first = next(instants(0.1, records_of(reader, begin_ns, end_ns), begin_ns, end_ns, 25.0))
            assert first.screens["aiko"].rgb.reshape(-1, 3).mean(axis=0) == pytest.approx(colour, abs=10), at_s


def test_the_page_of_a_replay_shows_it_at_its_moment_and_after_going_back_and_while_it_stands_still(
    shown: tuple[Path, float], tmp_path: Path
) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    log, begun_s = shown

    async def watch() -> None:
        async with served(log) as url, page(tmp_path, *SOFTWARE_GL) as tab:
            middle = {name: begun_s + (n + 0.8) * EACH_S for n, name in enumerate(COLOURS)}
            await tab.open(f"{url}#t={middle['magenta']}", 640, 480)
            await tab.until("document.documentElement.dataset.begun")
            if not await tab.value("window.vistel !== undefined"):
                pytest.skip("this Chromium has no WebGL")
            await tab.until("window.vistel.ready() === 3")
            await sees(tab, "magenta")
            for name in ("cyan", "green", "magenta"):
                await tab.value(f"window.vistelTravel.goTo({middle[name]})")
                await sees(tab, name)
            # However long it stands still: the looks for silence come every 1.5 s of the page's time.
            await tab.value("(real => { performance.now = () => real.call(performance) + 3600e3 })(performance.now)")
            await tab.value("new Promise(done => setTimeout(done, 3100))")
            await sees(tab, "magenta")
            await tab.value(f"window.vistelTravel.goTo({begun_s - 0.2})")
            await sees(tab, None)
            assert not [m for m in tab.messages if "Error" in m], tab.messages

    run(watch())


async def sees(tab: Page, name: str | None) -> None:
    """Wait until the panel is of this colour, and of no other; None: of none."""
    shares: dict[str, float] = {}
    while {n for n, much in shares.items() if much > 0.005} != ({name} if name else set()) or not shares:
        picture = await tab.picture()
        shares = {n: share(picture, n) for n in COLOURS}

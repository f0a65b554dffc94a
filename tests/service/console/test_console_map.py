"""The console's map of who sends what to whom, in a browser: what it says stands in the log, and what is lossy is marked."""

from __future__ import annotations

from pathlib import Path

import pytest
from browser import Page, page
from served_log import MEETING, SOFTWARE_GL, run, served

from vistel.session.going.flows import Flows
from vistel.wire.link.arrivals import Arrived
from vistel.wire.log import LogReader, LogWriter
from vistel_services.console import bundle

MOMENT = 3.0
EVERY = 5
"""Of Ben's motions each such one is missing."""
STILL_S = 0.6
"""So long before the moment Aiko's motion ends."""
OPEN = "[...document.querySelectorAll('#panel button')].find((b) => b.innerText.startsWith('Map')).click()"


def part(name: str) -> str:
    return f"document.querySelector('[data-id=\"{name}\"]')"


def with_gaps(log: Path) -> Path:
    """The meeting, with losses in Ben's motion, and an end of Aiko's before the moment that is looked at."""
    reader = LogReader(MEETING)
    end_ns = reader.begin_ns + round((MOMENT - STILL_S) * 1e9)
    with LogWriter(log, reader.conference_toml or "") as writer:
        for n, record in enumerate(reader.records()):
            who = record.names.get("participant") if record.topic.name == "motion" else None
            if (who == "ben" and n % EVERY == 0) or (who == "aiko" and record.log_ns > end_ns):
                continue
            writer.write(record.topic, record.key, record.message, record.log_ns)
    return log


async def at_the_moment(tab: Page, url: str, width: int) -> None:
    await tab.open(url, width, 800)
    await tab.until("Boolean(window.vistelTravel && document.querySelector('#panel table'))")
    await tab.value(f"window.vistelTravel.goTo({MOMENT})")
    await tab.until(f"Math.abs(window.vistelTravel.t() - {MOMENT}) < 1e-3")
    await tab.value(OPEN)


def test_the_map_says_what_flows_marks_what_is_lost_and_is_gone_through_by_keys(tmp_path: Path) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")

    async def look() -> None:
        log = with_gaps(tmp_path / "gaps.mcap")
        async with served(log) as url, page(tmp_path, *SOFTWARE_GL) as tab:
            await at_the_moment(tab, url, 1280)
            await tab.until(f"{part('site columbus motion')}?.getAttribute('class').includes('bad')")
            said = await tab.value(f"{part('site columbus motion')}.getAttribute('aria-label')")
            assert said.startswith("Motion from columbus to Router") and "kbit/s" in said and "% lost" in said, said
            assert "! " in await tab.value(f"{part('site columbus motion')}.textContent")
            await tab.until(f"{part('site tokyo motion')}.getAttribute('class').includes('bad')")  # old, as the table has it
            assert "lost" not in await tab.value(f"{part('site tokyo motion')}.textContent")
            assert "fine" in await tab.value(f"{part('world state')}.getAttribute('class')")
            assert "absent" in await tab.value(f"{part('world command')}.getAttribute('class')")
            assert await tab.value("document.querySelector('#room').hidden")

            await tab.value(f"{part('site tokyo')}.focus()")
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowDown", code="ArrowDown")
            await tab.until("document.activeElement.dataset.id === 'site tokyo motion'")
            await tab.until("document.querySelector('.map figcaption span').innerText === document.activeElement.ariaLabel")
            assert await tab.value("document.querySelectorAll('.map [tabindex=\"0\"]').length") == 1
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="Escape", code="Escape")
            await tab.until("!document.querySelector('.map') && !document.querySelector('#room').hidden")

            await at_the_moment(tab, url, 390)
            await tab.until("Boolean(document.querySelector('.flows .motion.bad'))")
            assert not await tab.value("Boolean(document.querySelector('.map'))")
            assert await tab.value("document.querySelectorAll('.flows section').length") == 2 + 3
            assert await tab.value("document.querySelector('.flows').scrollWidth <= 390")
            assert not [m for m in tab.messages if "Error" in m], tab.messages

    run(look())


def test_flows_are_counted_by_site_and_kind_and_know_what_is_missing() -> None:
    of_key = {f"k{n}": Arrived("motion", {"site": "tokyo", "participant": f"p{n}"}, 0) for n in range(2)}
    of_key["s"] = Arrived("world_state", {}, None)
    flows = Flows()
    message = next(r.message for r in LogReader(MEETING).records(("motion",)))
    for number in (1, 2, 4):
        message.header.seq = number
        for each in of_key.values():
            each.count(message)
        if number == 1:
            begun = flows.now(message.header.t_ns, of_key)
            assert [(row["site"], row["flow"]) for row in begun] == [("", "world"), ("tokyo", "motion")]
            assert all("per_s" not in row for row in begun)
    world, motion = flows.now(message.header.t_ns + 2_000_000_000, of_key)
    assert motion == {
        "site": "tokyo",
        "flow": "motion",
        "age_ms": 2000.0,
        "per_s": 2.0,
        "kbit_s": round(2 * message.ByteSize() * 8e-3, 1),
        "lost": round(2 / 6, 4),
    }
    assert world["per_s"] == 1.0 and "lost" not in world


def test_what_was_sent_after_the_clock_was_read_has_no_age_below_zero() -> None:
    arrived = Arrived("heartbeat", {"site": "tokyo"}, 0, messages=1, sent_ns=2_000_000_000)
    assert [row["age_ms"] for row in Flows().now(1_950_000_000, {"key": arrived})] == [0.0]

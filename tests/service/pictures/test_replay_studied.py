"""What the page of a log shows beside pictures: plots, notes, a second log, voices, files."""

from __future__ import annotations

import asyncio
import contextlib
import json
import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import pytest
from browser import Page, page
from page_speech import LISTEN, talk
from test_replay_page import MEETING, SOFTWARE_GL, heard, run, served

import vistel.log
from vistel.audio.forwarded_voices import FORMAT
from vistel.audio.opus import FRAME, FRAME_NS, Encoder
from vistel.figure.posture.posture import pose_joints
from vistel.log.numbers import skeleton_of
from vistel.log.two import DIFFERENCE
from vistel.messages.notes import NoteError
from vistel.v1.audio_pb2 import Voice
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.topics import BY_NAME
from vistel_services.console import bundle, replays

HAND = "participant.ben.motion.left_hand.x"
STANDS = "document.querySelector('.play').textContent.includes('▶')"
"""JavaScript: whether the log is not played."""
PLOT = {"id": 1, "names": [HAND], "from": 0.0, "to": 6.0, "wide": 500}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A copy, beside which notes may be written."""
    return Path(shutil.copy(MEETING, tmp_path / "a.mcap"))


def with_voice(path: Path) -> Path:
    """The meeting with ben's voice in it."""
    reader, encoder, sound = LogReader(MEETING), Encoder(), talk(3, 6.0)
    spoken: list[tuple[int, Any]] = []
    for n in range(len(sound) // FRAME):
        message = Voice(opus=encoder.encode(sound[n * FRAME : (n + 1) * FRAME]), level_db=-20.0, talking=True)
        message.header.version, message.header.seq = 1, n + 1
        message.header.t_ns = reader.begin_ns + n * FRAME_NS
        spoken.append((message.header.t_ns + 40_000_000, message))
    key = BY_NAME["voice"].format(conference="meeting", site="columbus", participant="ben")
    with LogWriter(path, reader.conference_toml) as writer:
        for r in reader.records():
            while spoken and spoken[0][0] <= r.log_ns:
                writer.write(BY_NAME["voice"], key, spoken[0][1], spoken.pop(0)[0])
            writer.write(r.topic, r.key, r.message, r.log_ns)
    return path


def test_numbers_of_a_log_are_listed_and_plotted_and_what_cannot_be_is_said() -> None:
    async def watch() -> None:
        async with served(MEETING) as url, aiohttp.ClientSession() as session, session.ws_connect(f"{url}live") as live:
            await live.send_json({"fields": True})
            assert [HAND, "m"] in (await heard(live, "fields"))["fields"]
            await live.send_json({"plot": PLOT})
            plot = await heard(live, "plot", lambda w: w["done"] == 1.0)
            (curve,) = plot["curves"]
            assert plot["id"] == 1 and curve["unit"] == "m" and len(curve["t"]) > 300
            await live.send_json({"plot": PLOT | {"id": 2, "names": ["thing.nothing.x"]}})
            assert "nothing" in (await heard(live, "plot", lambda w: w["id"] == 2))["fault"]
            for wrong in (PLOT | {"names": []}, PLOT | {"to": -1}, 3):
                await live.send_json({"plot": wrong})
                await heard(live, "refused")
            for number in range(3, 20):  # only the newest question counts
                await live.send_json({"plot": PLOT | {"id": number}})
            await heard(live, "plot", lambda w: w["id"] == 19 and w["done"] == 1.0)

    run(watch())


def test_a_note_is_told_to_all_who_look_and_stands_beside_the_log(log: Path) -> None:
    async def watch() -> None:
        async with (
            served(log) as url,
            aiohttp.ClientSession() as session,
            session.ws_connect(f"{url}live") as one,
            session.ws_connect(f"{url}live") as other,
        ):
            assert (await heard(one, "notes"))["notes"] == []
            await one.send_json({"t": 2.5})
            await one.send_json({"note": "<b>here</b>", "author": "Ann"})
            for live in (one, other):
                told = await heard(live, "notes", lambda w: w["notes"])
                assert told["notes"] == [{"t": 2.5, "author": "Ann", "text": "<b>here</b>"}]
            for wrong in (
                {"note": "x" * 501, "author": "a"},
                {"note": 3, "author": "a"},
                {"note": "a"},
                {"note": " ", "author": "a"},
            ):
                await one.send_json(wrong)
                assert "a note" in (await heard(one, "refused"))["reason"]

    run(watch())
    assert log.read_bytes() == MEETING.read_bytes() and len(Path(f"{log}.notes").read_text().splitlines()) == 1


def test_voices_are_sent_at_their_own_speed_only(tmp_path: Path) -> None:
    path = with_voice(tmp_path / "voiced.mcap")

    async def at_speed(live: aiohttp.ClientWebSocketResponse, speed: float, until_s: float) -> int:
        """Packets of voices that came while it was played from the beginning."""
        await live.send_json({"t": 0.0, "speed": speed, "playing": False, "hears": True})
        await heard(live, "playhead", lambda w: w["t"] == 0.0)
        await live.send_json({"playing": True})
        count = 0
        async for said in live:
            if said.type is aiohttp.WSMsgType.BINARY:
                count += said.data[0] == FORMAT
            elif (words := json.loads(said.data))["kind"] == "playhead" and words["t"] > until_s:
                break
        await live.send_json({"playing": False})
        return count

    async def watch() -> None:
        async with served(path) as url, aiohttp.ClientSession() as session, session.ws_connect(f"{url}live") as live:
            await heard(live, "playhead")
            count = 0
            while count <= 5:  # a busy machine puts many packets into one message, and leaves out what it is too late for
                count += await at_speed(live, 1.0, 2.0)
            assert await at_speed(live, 4.0, 4.0) <= 1  # what was on its way
            assert await at_speed(live, 0.5, 1.0) <= 1

    run(watch())


def test_a_part_comes_as_a_file_and_other_pages_get_none() -> None:
    async def watch() -> None:
        async with served(MEETING) as url, aiohttp.ClientSession() as session:
            part = {"kind": "csv", "of": HAND, "from": "1", "to": "2"}
            async with session.get(f"{url}export", params=part) as answer:
                assert answer.status == 200 and 'filename="meeting.csv"' in answer.headers["Content-Disposition"]
                assert (await answer.text()).splitlines()[0] == f"t,{HAND}"
            async with session.get(f"{url}export", params=part | {"kind": "exe"}) as answer:
                assert answer.status == 400
            async with session.get(f"{url}export", params=part | {"kind": "bvh", "of": "nobody"}) as answer:
                assert answer.status == 400 and "nobody" in await answer.text()
            async with session.get(f"{url}export", params=part, headers={"Origin": "http://evil.example"}) as answer:
                assert answer.status == 403

    run(watch())


@contextlib.asynccontextmanager
async def opened(tmp_path: Path, log: Path, hash_: str, beside: Path | None = None, *flags: str) -> AsyncIterator[Page]:
    """The page of a log in a browser, once its figures are there."""
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    async with served(log, beside) as url, page(tmp_path, *SOFTWARE_GL, *flags) as tab:
        await tab.call("Emulation.setFocusEmulationEnabled", enabled=True)
        await tab.open(f"{url}{hash_}", 480, 400)
        await tab.until("document.documentElement.dataset.begun")
        if not await tab.value("window.vistel !== undefined"):
            pytest.skip("this Chromium has no WebGL")
        await tab.until("window.vistel.ready() === 2")
        yield tab
        assert not [m for m in tab.messages if "Error" in m], tab.messages


async def key(tab: Page, text: str) -> None:
    await tab.value(f"dispatchEvent(new KeyboardEvent('keydown', {{ key: {json.dumps(text)} }}))")


def test_in_a_browser_a_number_is_found_by_words_plotted_with_its_unit_and_follows_the_zoom(tmp_path: Path, log: Path) -> None:
    async def watch() -> None:
        async with opened(tmp_path, log, "#t=4.5") as tab:
            await tab.value("document.querySelector('.chooser input').focus()")
            await tab.until("document.querySelectorAll('.found li').length > 5")
            await tab.call("Input.insertText", text="ben left_hand x")
            await tab.until("document.querySelectorAll('.found li').length === 1")
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="Enter", code="Enter", windowsVirtualKeyCode=13)
            await tab.until("document.querySelectorAll('.plot canvas').length === 1")
            await tab.until("Math.abs(window.vistelTravel.t() - 4.5) < 1e-3")
            await tab.until("document.querySelector('.legend output').textContent.endsWith(' m')")
            value = float((await tab.value("document.querySelector('.legend output').textContent")).removesuffix(" m"))
            with vistel.log.open(log) as whole:
                wanted = min(whole.postures("ben", 4.4, 4.7), key=lambda timed: abs(timed[0] - 4.5))[1]
                hand = pose_joints(skeleton_of(whole, "ben"), wanted).position
            assert np.abs(hand[:, 0] - value).min() < 0.002
            assert HAND in await tab.value("decodeURIComponent(location.hash)")
            before = await tab.value("window.vistelTravel.curves()[0].t.length")
            for _ in range(3):
                await key(tab, "+")
            seen = await tab.value("window.vistelTravel.seen()")
            assert seen[1] - seen[0] < 1.0 and seen[0] < 4.5 < seen[1]
            # An eighth is seen. A page that gets a scroll bar meanwhile has a few columns less.
            await tab.until(f"window.vistelTravel.curves()[0].t.length < {before} / 2")
            await key(tab, "0")
            await tab.until(f"window.vistelTravel.curves()[0].t.length > {before} / 2")
            await tab.value("document.querySelector('.legend button').click()")
            await tab.until("document.querySelectorAll('.plot').length === 0")

    run(watch())


def test_in_a_browser_a_note_is_written_marked_and_gone_to_and_stays_written_until_it_is_kept(
    tmp_path: Path, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = replays.Replays.note

    def full(*_: Any) -> None:
        monkeypatch.setattr(replays.Replays, "note", kept)
        raise NoteError("the disk is full")

    monkeypatch.setattr(replays.Replays, "note", full)

    async def watch() -> None:
        async with opened(tmp_path, log, "#t=2.5") as tab:
            await tab.until("Math.abs(window.vistelTravel.t() - 2.5) < 1e-3")
            await tab.value("document.querySelector('[name=note]').focus()")
            await tab.call("Input.insertText", text="<img src=x onerror=alert(1)>")
            await tab.until("document.querySelector('[name=note]').value")
            await tab.value("document.querySelector('.note button').click()")
            await tab.until("document.querySelector('.noted').textContent === 'the disk is full'")
            await tab.value("document.querySelector('.note button').click()")
            await tab.until("document.querySelectorAll('ol.notes li').length === 1")
            await tab.until("document.querySelector('[name=note]').value === ''")
            assert await tab.value("document.querySelector('ol.notes span').textContent") == "<img src=x onerror=alert(1)>"
            await tab.until("document.querySelectorAll('.track b.noted').length === 1")
            await key(tab, "Home")
            await tab.until("window.vistelTravel.t() === 0")
            await key(tab, "n")
            await tab.until("Math.abs(window.vistelTravel.t() - 2.5) < 1e-3")

    run(watch())


def test_in_a_browser_the_people_of_another_log_stand_as_ghosts_where_they_were_then(tmp_path: Path, log: Path) -> None:
    with vistel.log.open(MEETING) as whole:
        skeleton = skeleton_of(whole, "ben")
        (_, now), (_, later) = (
            min(whole.postures("ben", t - 0.1, t + 0.2), key=lambda timed: abs(timed[0] - t)) for t in (4.0, 5.0)
        )
        wanted = [pose_joints(skeleton, posture).position for posture in (now, later)]

    async def near(tab: Page, what: str, place: np.ndarray) -> bool:
        joints = np.array(await tab.value(f"window.vistel.{what}('ben')"))
        return bool(joints.size) and float(np.abs(joints - place).max()) < 0.03

    async def watch() -> None:
        async with opened(tmp_path, log, f"#t=4&plot={DIFFERENCE}{HAND}", MEETING) as tab:
            await tab.until("document.querySelector('.beside input') !== null")
            await tab.until("window.vistelTravel.curves().length === 1")
            assert await tab.value("Math.max(...window.vistelTravel.curves()[0].v.map(Math.abs))") == 0
            await tab.value(
                "(() => { const field = document.querySelector('.beside input'); field.value = '1';"
                " field.dispatchEvent(new Event('change', { bubbles: true })); })()"
            )
            while not (await near(tab, "joints", wanted[0]) and await near(tab, "ghost", wanted[1])):
                await asyncio.sleep(0.05)
            await tab.until("Math.max(...window.vistelTravel.curves()[0].v.map(Math.abs)) > 0.01")

    run(watch())


def test_in_a_browser_the_log_is_heard_at_its_own_speed_and_elsewhere_the_page_says_that_it_is_silent(tmp_path: Path) -> None:
    path = with_voice(tmp_path / "voiced.mcap")

    async def watch() -> None:
        async with opened(tmp_path, path, "#t=1", None, "--autoplay-policy=no-user-gesture-required") as tab:
            await tab.click("#sound button")
            await tab.until("window.vistel.voices.on")
            await tab.until("document.querySelector('.said').textContent.includes('silent')")

            async def played_until(holds: str) -> None:
                """Play, and from the beginning once more where the log has come to its end before a busy machine has listened."""
                while not await tab.value(holds):
                    if await tab.value(STANDS):
                        await key(tab, "k")
                    await asyncio.sleep(0.05)

            await played_until("(window.vistel.voices.played.get('ben')?.played ?? 0) > 4800")
            assert await tab.value(LISTEN.replace("window.guest", "window.vistel"))
            await key(tab, "Home")
            await played_until("window.heard().some(([, level]) => level > 0.01)")
            await key(tab, "]")
            await tab.until("document.querySelector('.said').textContent.includes('silent at 2')")

    run(watch())

"""A log in the console's page: at a moment it shows what was captured then, and viewers that misbehave cost nobody anything."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import pytest
from browser import page
from served_log import MEETING, SOFTWARE_GL, run, served
from waiting import until

import vistel.log
from vistel.conference.model import Conference
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import standard_skeleton
from vistel.log.numbers import skeleton_of
from vistel.log.playhead import Playhead
from vistel.render.film.film import instants, records_of
from vistel.render.stage.stage import Instant
from vistel.wire.log import LogReader, LogWriter
from vistel_services.console import bundle, player
from vistel_services.console.replays import MOST_REPLAYS


async def heard(live: aiohttp.ClientWebSocketResponse, kind: str, such: Any = lambda words: True) -> dict[str, Any]:
    async with asyncio.timeout(600.0):
        async for said in live:
            if said.type is aiohttp.WSMsgType.TEXT and (words := json.loads(said.data))["kind"] == kind and such(words):
                return words
    raise AssertionError(f"no {kind}")


def test_a_viewer_goes_to_any_moment_and_misbehaving_changes_nothing() -> None:
    async def watch() -> None:
        async with served(MEETING) as url, aiohttp.ClientSession() as session:
            async with session.ws_connect(f"{url}live") as live:
                hello = await heard(live, "hello")
                assert hello["log"] == "meeting.mcap" and hello["grows"] is False
                for said in ("x", "[]", '{"t": NaN}', "[" * 2000):
                    await live.send_str(said)
                    await heard(live, "refused")
                await live.send_json({"t": 4.0})
                held = await heard(live, "held", lambda w: w["grasps"])
                assert held["grasps"] == [["aiko", "right", "baton"]]
                assert (await heard(live, "playhead", lambda w: w["t"] == 4.0))["playing"] is False
                await live.send_json({"t": 1.0})
                assert (await heard(live, "held"))["grasps"] == []
                await live.send_json({"t": 6.4, "playing": True, "speed": 16})
                assert (await heard(live, "playhead", lambda w: w["t"] == w["end"]))["playing"] is False
            async with session.ws_connect(f"{url}live") as live:  # a new viewer is told all lanes, however long ago they were made
                assert (await heard(live, "lanes", lambda w: w["done"] == 1.0))["grasps"]
            for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
                async with session.get(f"{url}live", headers=headers) as answer:
                    assert answer.status == 403
            opened = [await session.ws_connect(f"{url}live") for _ in range(MOST_REPLAYS)]
            for each in opened:
                await heard(each, "hello")
            async with session.get(f"{url}live") as answer:
                assert answer.status == 503
            for each in opened:
                await each.close()

    run(watch())


def test_a_moment_that_is_gone_to_is_seen_as_by_who_played_to_it_and_as_films_have_it() -> None:
    reader = LogReader(MEETING)
    conference = Conference.model_validate(reader.conference)
    delay_ns = round(conference.playout.recorded_s * 1e9)
    moments = np.arange(75, 165) / 30.0  # people take the baton, and hand it over

    def places(instant: Instant) -> np.ndarray:
        return np.array([pose_joints(standard_skeleton(p.about.height), p.posture).position for p in instant.people])

    async def seen(going: list[Playhead]) -> list[np.ndarray]:
        playing, out = player.Player(conference, reader, lambda kind, words: None), list[np.ndarray]()
        real = playing.feed.step

        def step(now_ns: int, *, heard: bool = False) -> Any:
            stepped = real(now_ns, heard=heard)
            out.append(places(stepped[0]))
            return stepped

        playing.feed.step = step
        for head in going:
            await playing.show(head)
        playing.close()
        return out

    async def compare() -> None:
        end = (reader.end_ns - reader.begin_ns) * 1e-9
        played = await seen([Playhead(end, t, playing=True) for t in moments])
        scrubbed = await seen([Playhead(end, t) for t in moments[::4]])
        for n in range(20, len(moments), 4):
            (leapt,) = await seen([Playhead(end, moments[n])])
            now_ns = reader.begin_ns + round(moments[n] * 1e9) + delay_ns
            (filmed,) = instants(delay_ns * 1e-9, records_of(reader, now_ns, now_ns), now_ns, now_ns + 10**9, 1.0)
            for other in (leapt, scrubbed[n // 4], places(filmed)):
                assert np.abs(other - played[n]).max() < 1e-3, moments[n]

    run(compare())


def test_what_is_no_log_or_of_another_version_is_said_and_a_log_that_grows_is_followed(tmp_path: Path) -> None:
    async def watch() -> None:
        none, other, growing = tmp_path / "none.mcap", tmp_path / "other.mcap", tmp_path / "growing.mcap"
        records = list(LogReader(MEETING).records())
        async with aiohttp.ClientSession() as session:
            async with served(none) as url:
                async with session.get(f"{url}live") as answer:
                    assert answer.status == 404
                none.write_bytes(b"no log at all")
                async with session.get(f"{url}live") as answer:
                    assert answer.status == 404 and "is not an MCAP log" in await answer.text()
            with LogWriter(other) as writer:
                for r in records[:300]:
                    r.message.header.version = 99
                    writer.write(r.topic, r.key, r.message, r.log_ns)
                    r.message.header.version = 1
            async with served(other) as url, session.ws_connect(f"{url}live") as live:
                lanes = await heard(live, "lanes", lambda w: w["done"] == 1.0)
                assert any("version 99" in line for line in lanes["damage"]) and lanes["people"] == []
            with LogWriter(growing) as writer:
                for r in records[:700]:
                    writer.write(r.topic, r.key, r.message, r.log_ns)
                writer.flush()
                async with served(growing) as url, session.ws_connect(f"{url}live") as live:
                    hello = await heard(live, "hello")
                    assert hello["grows"] is True and hello["end"] < 6.0
                    await heard(live, "playhead")
                    for r in records[700:]:
                        writer.write(r.topic, r.key, r.message, r.log_ns)
                    writer.flush()
                    longer = await heard(live, "playhead", lambda w: w["end"] > 6.5)
                    await live.send_json({"t": longer["end"]})
                    await heard(live, "held", lambda w: w["grasps"] == [["ben", "left", "baton"]])

    run(watch())


def test_a_browser_shows_a_moment_as_it_was_captured_and_its_keys_move_the_playhead(tmp_path: Path) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    at = 4.5
    with vistel.log.open(MEETING) as log:
        skeleton = skeleton_of(log, "aiko")
        _, posture = min(log.postures("aiko", at - 0.1, at + 0.2), key=lambda timed: abs(timed[0] - at))
        wanted = pose_joints(skeleton, posture).position

    async def watch() -> None:
        async with served(MEETING) as url, page(tmp_path, *SOFTWARE_GL) as tab:
            await tab.open(f"{url}#t={at}", 480, 400)
            await tab.until("document.documentElement.dataset.begun")
            if not await tab.value("window.vistel !== undefined"):
                pytest.skip("this Chromium has no WebGL")
            await tab.until("window.vistel.ready() === 2")
            await tab.until(f"Math.abs(window.vistelTravel.t() - {at}) < 1e-3")
            apart = 1.0
            for _ in range(100):  # until it has been drawn in its place
                joints = np.array(await tab.value("window.vistel.joints('aiko')"))
                apart = float(np.abs(joints[0] - wanted[0]).max())
                if apart <= 0.01:
                    break
                await asyncio.sleep(0.05)
            assert apart <= 0.01  # a frame of motion may be 17 ms away, and fingers lie on what is held
            await tab.until("document.querySelector('.said').textContent.includes('%') === false")

            async def key(text: str) -> None:
                await tab.value(f"dispatchEvent(new KeyboardEvent('keydown', {{ key: {json.dumps(text)} }}))")

            await key("Home")
            await tab.until("window.vistelTravel.t() === 0")
            await key("g")
            await tab.until("Math.abs(window.vistelTravel.t() - 3.03) < 0.05")
            assert (await tab.value("location.hash")).startswith("#t=3.0")
            await key("k")
            await tab.until("window.vistelTravel.t() > 3.5")
            await key("k")
            assert not [m for m in tab.messages if "Error" in m], tab.messages

    run(watch())


def test_a_page_whose_log_stands_still_draws_nothing_until_somebody_moves_the_playhead_or_the_view(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    sent, real = [0], player.Player.show

    async def show(*given: Any) -> Any:
        sent[0] += 1
        return await real(*given)

    monkeypatch.setattr(player.Player, "show", show)

    async def watch() -> None:
        async with served(MEETING) as url, page(tmp_path, *SOFTWARE_GL) as tab:
            await tab.open(f"{url}#t=4.5", 480, 400)
            await tab.until("document.documentElement.dataset.begun")
            if not await tab.value("window.vistel !== undefined"):
                pytest.skip("this Chromium has no WebGL")
            await tab.until("window.vistel.ready() === 2")

            async def drawn_while(frames: int) -> int:
                """How many pictures are drawn while the server sends so many frames."""
                before, last = await tab.value("window.vistel.drawn()"), sent[0] + frames
                await until(lambda: sent[0] >= last, "frames of a log that stands still")
                return await tab.value("window.vistel.drawn()") - before

            async def rests() -> int:
                """Pictures that are drawn for six frames, once drawing has ended."""
                for _ in range(60):
                    if await drawn_while(1) == 0:
                        break
                return await drawn_while(6)

            assert await rests() == 0
            for moves in ("window.vistelTravel.goTo(1.0)", "document.querySelector('#views button:nth-child(2)').click()"):
                drawn, joints = await tab.value("[window.vistel.drawn(), JSON.stringify(window.vistel.joints('aiko'))]")
                await tab.value(moves)
                await tab.until(f"window.vistel.drawn() > {drawn}")
                assert await rests() == 0
                assert (await tab.value("JSON.stringify(window.vistel.joints('aiko'))") != joints) is ("goTo" in moves)

    run(watch())

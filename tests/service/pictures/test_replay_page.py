"""A log in the console's page: at a moment it shows what was captured then, and viewers that misbehave cost nobody anything."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import pytest
import served_log
from browser import Page, page
from numpy.typing import NDArray
from served_log import MEETING, SOFTWARE_GL, run, served
from waiting import until

import vistel.log
from vistel.arrays import F64
from vistel.conference.model import Conference
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import pose_joints
from vistel.figure.rigid.weights import joints_only
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.log.numbers import skeleton_of
from vistel.log.playhead import Playhead
from vistel.render.figures.ghosts import Ghosts
from vistel.render.figures.people import files_of, load_avatar_of
from vistel.render.film.film import instants, records_of
from vistel.render.pressed_skin import PressedFigure
from vistel.render.stage.stage import Instant
from vistel.v1.geometry_pb2 import Vec3
from vistel.v1.world_pb2 import HandForce
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.topics import BY_NAME
from vistel_services.console import bundle, player, replays
from vistel_services.console.replays import MOST_REPLAYS


async def heard(live: aiohttp.ClientWebSocketResponse, kind: str, such: Any = lambda words: True) -> dict[str, Any]:
    async with asyncio.timeout(600.0):
        async for said in live:
            if said.type is aiohttp.WSMsgType.TEXT and (words := json.loads(said.data))["kind"] == kind and such(words):
                return words
    raise AssertionError(f"no {kind}")


async def taken(session: aiohttp.ClientSession, url: str) -> aiohttp.ClientWebSocketResponse:
    """A viewer, as soon as there is room: one who left is let go of a little later."""
    while True:
        with contextlib.suppress(aiohttp.WSServerHandshakeError):
            return await session.ws_connect(url)
        await asyncio.sleep(0.05)  # trying costs the server work


def test_playing_goes_on_from_where_it_stood_still_however_long_that_was() -> None:
    async def watch() -> None:
        async with served(MEETING) as url, aiohttp.ClientSession() as session, session.ws_connect(f"{url}live") as live:
            await live.send_json({"t": 0.0, "speed": 16})
            await heard(live, "playhead", lambda w: w["speed"] == 16)
            await asyncio.sleep(0.3)  # standing still is real time that passes
            before = time.monotonic()
            await live.send_json({"playing": True})
            moved = await heard(live, "playhead", lambda w: w["t"] > 0.0)
            assert moved["t"] <= 16 * (time.monotonic() - before)

    run(watch())


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
                await heard(live, "held", lambda w: w["grasps"] == [])
                await live.send_json({"t": 6.4, "playing": True, "speed": 16})
                assert (await heard(live, "playhead", lambda w: w["t"] == w["end"]))["playing"] is False
            async with session.ws_connect(f"{url}live") as live:  # a new viewer is told all lanes, however long ago they were made
                assert (await heard(live, "lanes", lambda w: w["done"] == 1.0))["grasps"]
            for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
                async with session.get(f"{url}live", headers=headers) as answer:
                    assert answer.status == 403
            opened = [await taken(session, f"{url}live") for _ in range(MOST_REPLAYS)]
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
            # Until it has been drawn in its place: a frame of motion may be 17 ms away, and fingers lie on what is held.
            far = f"Math.max(...window.vistel.joints('aiko')[0].map((x, n) => Math.abs(x - {wanted[0].tolist()}[n])))"
            await tab.until(f"{far} <= 0.01")
            await tab.until("document.querySelector('.said').textContent.includes('%') === false")

            async def key(text: str) -> None:
                await tab.value(f"dispatchEvent(new KeyboardEvent('keydown', {{ key: {json.dumps(text)} }}))")

            await tab.value("getSelection().selectAllChildren(document.body)")
            await dragged(tab, ".tracks", 0.2, 0.6)
            await tab.until("Math.abs(window.vistelTravel.t() / document.querySelector('.tracks').ariaValueMax - 0.6) < 0.01")
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


def test_skin_gives_way_in_a_browser_as_the_engine_has_it_and_who_is_chosen_shows_what_presses(tmp_path: Path) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    at = 6.2  # one takes a baton from the other

    async def watch() -> None:
        async with served(with_a_force(at, tmp_path)) as url, page(tmp_path, *SOFTWARE_GL) as tab:
            await tab.open(f"{url}#t={at}", 480, 400)
            await tab.until("document.documentElement.dataset.begun")
            if not await tab.value("window.vistel !== undefined"):
                pytest.skip("this Chromium has no WebGL")
            await tab.until("window.vistel.ready() === 2")
            await tab.until(f"Math.abs(window.vistelTravel.t() - {at}) < 1e-3")
            for who in ("aiko", "ben"):
                await tab.until(f"window.vistel.pressed({who!r}).length > 50")
                async with asyncio.timeout(600.0):  # what is pressed where they were before is shown for a picture or two
                    far = np.inf
                    while far > 1e-3:
                        corner, *place = np.array(await tab.value(f"window.vistel.pressed({who!r})")).T
                        rest, engine, of_hand = by_the_engine(at, who, corner.astype(int))
                        far = np.abs(np.transpose(place) - rest - engine).max()
                assert of_hand.sum() > 20
                assert np.linalg.norm(engine[of_hand], axis=1).max() > 5e-3
            assert await tab.value("window.vistel.contacts()") == [0, 0]
            choose = "[...document.querySelectorAll('.choices button')].find((b) => b.textContent.startsWith('ben'))"
            await tab.until(choose)
            await tab.value(f"{choose}.click()")
            await tab.until("document.querySelector('.card')?.textContent.includes('aiko (5.0 N)')")
            await tab.until("(([arrows, shapes]) => arrows === 1 && shapes > 5)(window.vistel.contacts())")  # with the next picture
            await tab.value(f"{choose}.click()")
            await tab.until("window.vistel.contacts().every((count) => count === 0)")

    run(watch())


def test_who_is_chosen_before_the_figures_come_shows_what_presses_once_they_are_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    go_on, asset = asyncio.Event(), replays.Replays.asset

    async def held_back(self: Any, request: Any) -> Any:
        await go_on.wait()
        return await asset(self, request)

    monkeypatch.setattr(replays.Replays, "asset", held_back)

    async def watch() -> None:
        async with served(with_a_force(6.2, tmp_path)) as url, page(tmp_path, *SOFTWARE_GL) as tab:
            await tab.open(f"{url}#t=6.2", 480, 400)
            await tab.until("document.documentElement.dataset.begun")
            if not await tab.value("window.vistel !== undefined"):
                pytest.skip("this Chromium has no WebGL")
            choose = "[...document.querySelectorAll('.choices button')].find((b) => b.textContent.startsWith('ben'))"
            await tab.until(choose)
            await tab.value(f"{choose}.click()")
            await tab.until("document.querySelector('.card')?.textContent.includes('aiko (5.0 N)')")
            assert await tab.value("window.vistel.ready()") == 0
            go_on.set()
            await tab.until("window.vistel.ready() === 2")
            await tab.until("(([arrows, shapes]) => arrows === 1 && shapes > 5)(window.vistel.contacts())")

    run(watch())


def test_a_page_whose_connection_breaks_comes_back_to_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    servers: list[Any] = []
    heads: list[Any] = []
    opened, visit, show = served_log.open_server, replays._Visit.__init__, replays._Visit._show
    told = asyncio.Event()
    told.set()

    async def show_later(self: Any) -> None:
        await told.wait()
        await show(self)

    async def open_server(*given: Any) -> Any:
        servers.append(await opened(*given))
        return servers[0]

    def visited(self: Any, *given: Any) -> None:
        visit(self, *given)
        heads.append(lambda: (self._head, self._offset))

    monkeypatch.setattr(served_log, "open_server", open_server)
    monkeypatch.setattr(replays._Visit, "__init__", visited)
    monkeypatch.setattr(replays._Visit, "_show", show_later)

    async def watch() -> None:
        async def broken(back: Callable[[Playhead, float], bool]) -> None:
            before = len(heads)
            for connection in servers[0]._runner.server.connections:
                connection.transport.abort()
            await until(lambda: len(heads) > before and back(*heads[-1]()), "back as it was")

        async with served(MEETING, MEETING) as url, page(tmp_path, *SOFTWARE_GL) as tab:
            await tab.open(f"{url}#t=4.5", 480, 400)
            for moment in (4.5, 3.0):  # that of the address, and one that the hand went to
                if moment != 4.5:
                    await tab.value(f"window.vistelTravel.goTo({moment})")
                await tab.until(f"window.vistelTravel && Math.abs(window.vistelTravel.t() - {moment}) < 1e-3")
                await until(lambda at=moment: heads[-1]()[0].t == at, "the playhead there")
                await broken(lambda head, _, at=moment: head.t == at and not head.playing)
            offset = "document.querySelector('.beside input')"
            await tab.value(f"{offset}.value = '0.25'; {offset}.dispatchEvent(new Event('change', {{ bubbles: true }}))")
            told.clear()  # it breaks before the page has been told that it was heard
            slower = "document.querySelector('select[aria-label=Speed]')"
            await tab.value(f"{slower}.value = '0.1'; {slower}.dispatchEvent(new Event('change', {{ bubbles: true }}))")
            await tab.click("button.play")
            await until(lambda: heads[-1]()[0].playing and heads[-1]()[0].speed == 0.1 and heads[-1]()[1] == 0.25, "playing")
            await broken(lambda head, shifted: head.playing and head.speed == 0.1 and shifted == 0.25 and head.t >= 3.0)
            told.set()
            await until(lambda: heads[-1]()[0].t > 3.0, "it goes on")

    run(watch())


def with_a_force(at: float, folder: Path) -> Path:
    """The meeting, in which ben's thumb feels aiko's hand about a moment."""
    reader, log = LogReader(MEETING), folder / "felt.mcap"
    with vistel.log.open(MEETING) as opened:
        posture = next(posture for t, posture in opened.postures("aiko", at - 0.1, at + 0.1))
        x, y, z = pose_joints(skeleton_of(opened, "aiko"), posture).position[JOINT_INDEX["right_hand"]]
    place = Vec3(x=x, y=y, z=z)
    key = BY_NAME["hand_force"].format(conference="meeting", participant="ben", hand="left")
    touch = HandForce.Touch(digit=HandForce.DIGIT_THUMB, body="aiko", point=place, force=Vec3(y=3.0, z=4.0), normal_force=5.0)
    with LogWriter(log, json.dumps(reader.conference)) as writer:
        for r in reader.records():
            writer.write(r.topic, r.key, r.message, r.log_ns)
            if r.topic.name == "world_state" and abs(r.message.header.t_ns - reader.begin_ns - at * 1e9) < 3e8:
                felt = HandForce(header=r.message.header, participant="ben", touches=[touch])
                writer.write(BY_NAME["hand_force"], key, felt, r.log_ns)
    return log


def by_the_engine(at: float, who: str, corner: NDArray[np.int_]) -> tuple[F64, F64, NDArray[np.bool_]]:
    """Of corners of somebody's file at a moment of the log: where their bones alone have them, (N, 3); how far the engine moves
    them from where it has them without what presses, (N, 3); whether they are of a hand."""
    reader = LogReader(MEETING)
    conference = Conference.model_validate(reader.conference)
    delay_s = conference.playout.recorded_s
    now_ns = reader.begin_ns + round((at + delay_s) * 1e9)
    (now,) = instants(delay_s, records_of(reader, now_ns, now_ns + 1), now_ns, now_ns + 10**9, 1.0)
    avatars = {p.about.name: load_avatar_of(p.about, files_of(conference)) for p in now.people}
    shapes = {name: PressedFigure(avatar) for name, avatar in avatars.items()}
    posed = {p.about.name: shapes[p.about.name].posed(p.posture) for p in now.people}
    figure, posture = Figure(avatars[who]), next(p.posture for p in now.people if p.about.name == who)
    mesh, skeleton = avatars[who].mesh, avatars[who].skeleton
    vertex = mesh.corner_vertex[corner]
    alone = figure.pose(posture).vertices[vertex].astype(np.float64)
    state = figure.pose(posture, Ghosts().of(now, shapes, posed)[who])
    assert mesh.bone is not None
    assert mesh.weight is not None
    joints, (joint, share) = state.joints, joints_only(mesh.bone[vertex], mesh.weight[vertex])
    share = share / share.sum(axis=1, keepdims=True)
    from_joint = mesh.vertices[vertex][:, None] - skeleton.rest[joint]
    rest = np.einsum("nk,nki->ni", share, np.einsum("nkij,nkj->nki", joints.rotation[joint], from_joint) + joints.position[joint])
    names = np.array(avatars[who].body.names)[mesh.limb[vertex]]
    of_hand = np.array([name.endswith(("_knuckles", "_metacarpal", "_proximal", "_intermediate", "_distal")) for name in names])
    return rest, state.vertices[vertex] - alone, of_hand


async def dragged(tab: Page, selector: str, begin: float, end: float) -> None:
    """The mouse is pressed on an element, moved and released, at shares of its width."""
    await tab.value(f"document.querySelector({selector!r}).scrollIntoView()")
    x, y, width, height = await tab.value(
        f"((r) => [r.x, r.y, r.width, r.height])(document.querySelector({selector!r}).getBoundingClientRect())"
    )
    for kind, share in (("mousePressed", begin), *(("mouseMoved", s) for s in np.linspace(begin, end, 7)), ("mouseReleased", end)):
        place = {"x": x + share * width, "y": y + height / 2}
        await tab.call(
            "Input.dispatchMouseEvent", type=kind, **place, button="left", buttons=int(kind != "mouseReleased"), clickCount=1
        )


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
            await tab.until("window.vistel.pressed('ben').length > 0")  # that comes a little later than figures

            async def drawn_while(frames: int) -> int:
                """How many pictures are drawn while the server sends so many frames."""
                before, last = await tab.value("window.vistel.drawn()"), sent[0] + frames
                await until(lambda: sent[0] >= last, "frames of a log that stands still")
                return await tab.value("window.vistel.drawn()") - before

            async def rests() -> None:
                """Until none is drawn for six frames: a busy machine draws what has changed some frames later."""
                while await drawn_while(6):
                    pass

            await rests()
            for moves in ("window.vistelTravel.goTo(1.0)", "document.querySelector('#views button:nth-child(2)').click()"):
                drawn, joints = await tab.value("[window.vistel.drawn(), JSON.stringify(window.vistel.joints('aiko'))]")
                await tab.value(moves)
                await tab.until(f"window.vistel.drawn() > {drawn}")
                if "goTo" in moves:
                    await tab.until(f"JSON.stringify(window.vistel.joints('aiko')) !== {json.dumps(joints)}")
                await rests()
                assert (await tab.value("JSON.stringify(window.vistel.joints('aiko'))") != joints) is ("goTo" in moves)

    run(watch())

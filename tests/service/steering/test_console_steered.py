"""Who steers a conference from the console, on real sockets: what the host asks is done and recorded, others are refused."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from guest_room import GuestRoom
from prometheus_client import REGISTRY
from served_log import MEETING
from waiting import until

from vistel.conference.console import ConsoleConfig
from vistel.conference.invitations import invitations_in
from vistel.conference.model import Conference
from vistel.conference.running import studio_announced
from vistel.log.notes import beside
from vistel.session.steering import actions
from vistel.v1.service_pb2 import FaultReply, FaultRequest, RunProcess, RunReply, RunRequest
from vistel.wire.topics import BY_NAME
from vistel_services import world
from vistel_services.world.service import warm_up

TOKEN, HOST_TOKEN = "0123456789abcdef", "fedcba9876543210"
ASKED = {
    "ask": {"text": "reset"},
    "fault": {"name": "kill", "target": "hub/world"},
    "stop": {"process": "hub/world"},
    "mute": {"participant": "guest-1"},
    "remove": {"participant": "guest-1"},
    "seat": {"name": "Eve"},
}


class Steered:
    """A page's socket."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket, self._ids = socket, 0

    async def told(self, *kinds: str, **wanted: Any) -> dict[str, Any]:
        """The next words of one of these kinds that have these values."""
        async for said in self.socket:
            if said.type is aiohttp.WSMsgType.TEXT:
                words = json.loads(said.data)
                if words["kind"] in kinds and wanted.items() <= words.items():
                    return words
        raise AssertionError(f"no {kinds}")

    async def led(self) -> None:
        """Until a world leads the room. Before this it answers nobody."""
        while not any(world["leads"] for world in (await self.told("steering"))["worlds"]):
            pass

    async def do(self, action: str, **asked: Any) -> dict[str, Any]:
        """The answer to an action."""
        self._ids += 1
        await self.socket.send_json({"do": action, "id": self._ids, "by": "Hana"} | asked)
        return await self.told("steered", "refused", **{})


@contextlib.asynccontextmanager
async def opened(room: GuestRoom, token: str = "", path: str = "live", **headers: str) -> AsyncIterator[Steered]:
    """The console's page of whoever shows this token."""
    shown = headers | ({"Authorization": f"Bearer {token}"} if token else {})
    async with aiohttp.ClientSession() as session, session.ws_connect(f"http://{room.address}/{path}", headers=shown) as socket:
        yield Steered(socket)


@contextlib.asynccontextmanager
async def studios_run(address: str) -> AsyncIterator[None]:
    with studio_announced(address):
        yield


def refused_so_far() -> float:
    return REGISTRY.get_sample_value("vistel_console_steering_refused_total") or 0.0


def test_what_the_host_asks_is_done_by_the_world_and_what_cannot_be_is_refused_in_a_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    async def visit() -> None:
        room = GuestRoom(tmp_path)
        acts = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["host_action"], queue_all=True, polled=True)
        async with room.serving(monkeypatch), room.led(), opened(room) as host:
            assert (await host.told("hello"))["steers"]
            await host.led()
            done = await host.do("ask", text="paint the red baton blue")
            assert (done["done"], done["answer"]) == (True, "baton")
            for line, why in (
                ("paint the elephant blue", "elephant"),
                ("move the ball left", "the host stands nowhere in the room"),
                ("hand up", "host is not in the room"),
                ("fly away", "there is no command 'fly'"),
                ("reset\n", "expected a line"),
            ):
                answer = await host.do("ask", text=line)
                assert not answer["done"] and why in answer["answer"], (line, answer)
            assert (await host.do("undo the world"))["answer"].startswith("no action is called")
            kept = [(s.message.who, s.message.action, s.message.text, s.message.done) for s in acts.take()]
            assert kept[0] == ("Hana", "ask", "paint the red baton blue", True) and len(kept) == 7
            assert not any(done for _, _, _, done in kept[1:])

    warm_up()
    asyncio.run(visit())


def test_the_room_is_moved_to_a_world_that_waits(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def visit() -> None:
        room = GuestRoom(tmp_path)
        data = room.conference.model_dump(mode="json", exclude_none=True)
        room.conference = Conference.model_validate(
            data | {"world": {"on": "hub", "waiting": ["guests"], "folder": str(tmp_path / "r")}}
        )
        waits = world.configure(room.conference, room.conference.sites[0], room.paths)
        async with room.serving(monkeypatch), room.led(), opened(room) as host:
            await host.led()
            waiting = asyncio.create_task(world.run(waits, room.network.bus("c", "hub", room.clock), room.clock))
            while len((await host.told("steering"))["worlds"]) < 2:
                pass
            assert "no world is at 'paris'; there are hub, guests" in (await host.do("move", place="paris"))["answer"]
            moved = await host.do("move", place="guests")
            assert moved["done"], moved
            while (await host.told("steering"))["worlds"][0] != {"place": "guests", "leads": True}:
                pass
            waiting.cancel()
            await asyncio.gather(waiting, return_exceptions=True)

    warm_up()
    asyncio.run(visit())


def test_a_line_that_is_typed_is_completed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def visit() -> None:
        async with GuestRoom(tmp_path).serving(monkeypatch) as room, opened(room) as host:
            for line, words, thing in (("be", ["bend"], False), ("paint the ball r", ["red"], True)):
                await host.socket.send_json({"complete": line})
                found = await host.told("completions", line=line)
                assert (found["words"], found["thing"]) == (words, thing)

    asyncio.run(visit())


def test_faults_and_processes_are_passed_on_with_who_asks_and_told_of(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def visit() -> None:
        room = GuestRoom(tmp_path)
        asked: list[tuple[str, str, str]] = []

        def fault(request: bytes) -> FaultReply:
            said = FaultRequest.FromString(request)
            asked.append((said.name, said.target, said.by))
            return FaultReply(struck="kill hub/world") if said.target else FaultReply(refused="kill: expected a process")

        def run(request: bytes) -> RunReply:
            said = RunRequest.FromString(request)
            if said.action:
                asked.append((RunRequest.Action.Name(said.action), said.process, said.by))
            return RunReply(done="restarting hub/world", processes=[RunProcess(name="hub/world", state=RunProcess.STATE_RUNNING)])

        async with room.serving(monkeypatch), opened(room) as host:
            assert not (await host.told("steering"))["runs"]
            assert "no `vistel up` answers" in (await host.do("restart", process="hub/world"))["answer"]
            up = room.network.bus("c", "hub", room.clock)
            up.serve(BY_NAME["fault"], fault)
            up.serve(BY_NAME["run"], run)
            state = await host.told("steering", runs=True)
            assert state["processes"] == [{"name": "hub/world", "state": "running", "restarts": 0}]
            assert (await host.do("fault", name="kill", target="hub/world"))["answer"] == "kill hub/world"
            assert not (await host.do("fault", name="kill"))["done"]
            assert "seconds: expected a number" in (await host.do("fault", name="hang", seconds="long"))["answer"]
            assert (await host.do("restart", process="hub/world"))["answer"] == "restarting hub/world"
            assert asked == [("kill", "hub/world", "Hana"), ("kill", "", "Hana"), ("ACTION_RESTART", "hub/world", "Hana")]

    asyncio.run(visit())


def test_a_guest_is_seated_muted_and_removed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def visit() -> None:
        room = GuestRoom(tmp_path)
        acts = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["host_action"], queue_all=True, polled=True)
        status = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["sound_status"], polled=True)

        def muted() -> list[str]:
            return [m.participant for s in status.take() for m in s.message.microphones if m.muted]

        async with room.serving(monkeypatch), opened(room) as host:
            seat = await host.do("seat", name="Ann")
            assert seat["done"] and seat["token"], seat
            assert [i.name for i in invitations_in(tmp_path)] == ["Ann"]
            async with room.opened(seat["token"]) as page:
                assert (await page.told("invited"))["participant"] == "guest-1"
                state = await host.told("steering", runs=False)
                while not any(p["invited"] == "Ann" for p in state["people"]):
                    state = await host.told("steering")
                assert (await host.do("mute", participant="guest-1"))["done"]
                await until(lambda: "guest-1" in muted(), "the guest is muted")
                assert (await host.do("remove", participant="guest-1"))["done"]
                assert await page.code() == 4410
            assert "nobody is invited" in (await host.do("remove", participant="guest-1"))["answer"]
            assert "no participant" in (await host.do("mute", participant="nobody"))["answer"]
            assert "no seat" in (await host.do("seat", name="Ann", seat="throne"))["answer"]
            assert not any(seat["token"] in str(sample.message) for sample in acts.take())
            assert seat["token"] not in caplog.text

    with caplog.at_level(logging.INFO):
        asyncio.run(visit())
    assert "event=steered who='Hana' from=127.0.0.1 action='seat'" in caplog.text


def test_only_who_has_a_microphone_that_answers_is_muted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    people = [{"name": "hiro"}, {"name": "aiko", "display_name": "Aiko"}]
    osaka = {"name": "osaka", "audio": {"microphone": "sim"}, "participants": people}  # the microphone of the first

    async def visit() -> None:
        room = GuestRoom(tmp_path)
        data = room.conference.model_dump(mode="json", exclude_none=True)
        room.conference = Conference.model_validate(data | {"sites": [*data["sites"], osaka], "room": {"seats": 4}})
        muting = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["muting"], queue_all=True, polled=True)
        async with room.serving(monkeypatch), opened(room) as host:
            rows = {row["name"]: row for row in (await host.told("steering"))["people"]}
            assert (rows["aiko"]["shown"], rows["aiko"]["speaks"]) == ("Aiko", False)
            assert (rows["hiro"]["shown"], rows["hiro"]["speaks"]) == ("hiro", True)
            said = await host.do("mute", participant="aiko")
            assert (said["done"], said["why"], said["values"]) == (False, "no_microphone", ["aiko"]), said
            assert not muting.take()
            monkeypatch.setattr(actions, "ANSWER_S", 0.1)  # services of osaka do not run
            said = await host.do("mute", participant="hiro")
            assert (said["done"], said["why"], said["values"]) == (False, "not_muted", ["osaka", "hiro"]), said
            assert [sample.message.participant for sample in muting.take()] == ["hiro"]

    asyncio.run(visit())


def test_who_shows_only_the_viewers_token_is_refused_counted_and_logged(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def visit() -> None:
        room = GuestRoom(tmp_path, ConsoleConfig(at="127.0.0.1:0", token=TOKEN, host_token=HOST_TOKEN))
        hub = room.network.bus("c", "hub", room.clock)
        acts = hub.subscribe(BY_NAME["host_action"], queue_all=True, polled=True)
        told = [hub.subscribe(BY_NAME[topic], queue_all=True, polled=True) for topic in ("command", "muting", "note")]
        asked: list[bytes] = []
        for topic in ("fault", "run"):
            hub.serve(BY_NAME[topic], asked.append)
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
        async with room.serving(monkeypatch), studios_run("http://127.0.0.1:8765/avatar/"):
            link = room.invited()
            async with opened(room, TOKEN) as viewer:
                hello = await viewer.told("hello")
                assert not hello["steers"] and not hello["studio"]
                before = refused_so_far()
                said = [{"do": action, "id": 1} | words for action, words in ASKED.items()]
                said += [{"note": "x", "author": "Eve"}, {"complete": "b"}, {"lines": {}}]
                for words in said:
                    await viewer.socket.send_json(words)
                    assert "only who has the host's token may steer" in (await viewer.told("refused"))["reason"]
                assert refused_so_far() == before + len(said)
            assert not asked and not acts.take() and not any(topic.take() for topic in told)
            async with opened(room, HOST_TOKEN) as host:
                hello = await host.told("hello")
                assert hello["steers"] and hello["studio"] == "http://127.0.0.1:8765/avatar/"
                assert (await host.do("mute", participant="guest-1"))["done"]
            with pytest.raises(aiohttp.WSServerHandshakeError):
                async with opened(room, link):
                    pass
            async with room.opened(link) as guest:
                await guest.told("invited")
                for action, words in ASKED.items():
                    await guest.socket.send_json({"do": action, "id": 1} | words)
                await guest.socket.send_json({"time": 1.0})
                await guest.told("time")
            assert [s.message.action for s in acts.take()] == ["mute"]
            assert [i.participant for i in invitations_in(tmp_path)] == ["guest-1"]

    with caplog.at_level(logging.WARNING):
        asyncio.run(visit())
    assert caplog.text.count("event=steering_refused from=127.0.0.1") == 1


def test_a_note_on_a_log_is_the_hosts_as_well(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def visit() -> None:
        room = GuestRoom(tmp_path, ConsoleConfig(at="127.0.0.1:0", token=TOKEN, host_token=HOST_TOKEN))
        log = Path(shutil.copy(MEETING, room.paths.log))
        async with room.serving(monkeypatch):
            for token, kind in ((TOKEN, "refused"), (HOST_TOKEN, "notes")):
                async with opened(room, token, path="past") as viewer:
                    await viewer.told("notes")
                    await viewer.socket.send_json({"note": "here", "author": "Eve"})
                    await viewer.told(kind)
                    assert beside(log).exists() == (token == HOST_TOKEN)

    asyncio.run(visit())


def test_without_a_token_who_comes_by_a_proxy_sees_and_does_not_steer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def visit() -> None:
        async with GuestRoom(tmp_path).serving(monkeypatch) as room:
            for header in ("X-Forwarded-For", "Forwarded", "Via"):
                async with opened(room, **{header: "for=192.0.2.7"}) as viewer:
                    assert not (await viewer.told("hello"))["steers"]
                    assert (await viewer.do("ask", text="reset"))["kind"] == "refused"

    asyncio.run(visit())


def test_who_has_the_hosts_token_enters_by_the_form(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def visit() -> None:
        room = GuestRoom(tmp_path, ConsoleConfig(at="127.0.0.1:0", token=TOKEN, host_token=HOST_TOKEN))
        async with room.serving(monkeypatch):
            for token, steers in ((TOKEN, False), (HOST_TOKEN, True)):
                jar = aiohttp.CookieJar(unsafe=True)
                async with aiohttp.ClientSession(cookie_jar=jar) as session:
                    async with session.post(f"http://{room.address}/", data={"token": token}) as answer:
                        assert answer.status == 200
                    async with session.ws_connect(f"http://{room.address}/live") as socket:
                        assert (await Steered(socket).told("hello"))["steers"] is steers

    asyncio.run(visit())


def test_log_lines_are_told_as_they_are_filtered(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    log = tmp_path / "logs" / "tokyo-renderer.log"
    log.write_text(
        "2026-11-21T09:15:02.123Z INFO    tokyo/renderer vistel.host process up\n"
        "2026-11-21T09:15:03.123Z ERROR   tokyo/renderer vistel.renderer event=\x1b[31m<b>broken\n"
        "a library says so\n"
    )

    async def visit() -> None:
        async with GuestRoom(tmp_path).serving(monkeypatch) as room, opened(room) as host:
            await host.socket.send_json({"lines": {"level": "WARNING"}})
            lines = (await host.told("lines"))["lines"]
            while not lines:
                lines = (await host.told("lines"))["lines"]
            assert [line[1:] for line in lines] == [["ERROR", "tokyo/renderer", "vistel.renderer event= [31m<b>broken"]]
            with log.open("a") as file:
                file.write("2026-11-21T09:15:04.123Z WARNING hub/world vistel.world late\n")
            while len(lines := (await host.told("lines"))["lines"]) < 2:
                pass
            await host.socket.send_json({"lines": {"node": "hub/world", "text": "LATE"}})
            while len(lines := (await host.told("lines"))["lines"]) != 1:
                pass
            assert lines[0][2] == "hub/world"

    asyncio.run(visit())

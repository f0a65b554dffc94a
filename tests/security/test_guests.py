"""Whoever has a link is let in, as the guest of that link and within what a guest may do; nobody else is."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import aiohttp
import numpy as np
import pytest
from guest_room import GuestPage, GuestRoom, in_room, visit_with_a_flood, visit_with_faults
from waiting import until
from yarl import URL

from vistel.audio.forwarded_voices import FORMAT
from vistel.audio.opus import FRAME, FRAME_NS, Encoder
from vistel.audio.page_voice import MOST_PACKET_BYTES, voice_record
from vistel.conference.console import ConsoleConfig
from vistel.conference.invitations import withdraw
from vistel.protocol.pages.camera_body import BODY, Seen, camera_record
from vistel.protocol.pages.pointer import guest_record, posture_record
from vistel.session.chat import Chat
from vistel.session.guest_lines import MOST_LINES
from vistel.v1.device_pb2 import PointerFrame
from vistel_services.console import guests, landmarks

SITS = posture_record(0.2, -0.1)


def test_who_has_the_link_enters_moves_leaves_and_comes_back_to_the_seat(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(room: GuestRoom) -> None:
        link = room.invited()
        for visit in (1, 2):
            async with room.opened(link) as page:
                await page.enter("ben")
                async with page.listening():  # where her figure must be made first, this takes longer than a page may be deaf
                    await page.socket.send_bytes(SITS)
                    await room.until(lambda n=visit: len(room.heard) == 2 * n - 1 and "guest-1" in room.moved, "Ann in the room")
                here = room.heard[-1]
                assert (here.participant, here.site, here.display_name) == ("guest-1", "guests", "Ann")
                assert here.avatar == "builtin:person=ben" and not here.left
            await room.until(lambda n=visit: len(room.heard) == 2 * n and room.heard[-1].left, "Ann has left")
            room.moved.clear()
        assert {m.device for m in room.pointed} == {"guest-1-pointer"}

    in_room(tmp_path, monkeypatch, play)


def test_a_wrong_an_ended_and_a_replaced_link_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(room: GuestRoom) -> None:
        old, new = room.invited(name="Ann"), room.invited(name="Bob")
        ended = room.invited("guest-2", "Cas", -1)
        for token, says in ((old, "newer"), (ended, "has ended"), ("", "newer"), ("x" * 200, "newer")):
            async with room.opened(token) as page:
                assert says in (await page.told("refused"))["reason"]
                assert await page.code() == guests.REFUSED
        async with room.opened(new) as page:
            assert (await page.told("invited"))["name"] == "Bob"
        assert room.heard == []

    in_room(tmp_path, monkeypatch, play)


def test_a_seat_whose_device_does_not_run_here_is_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(room: GuestRoom) -> None:
        room.paths.device("guest-1-pointer").unlink()
        async with room.opened(room.invited()) as page:
            assert "does not run on the console's machine" in (await page.told("refused"))["reason"]

    in_room(tmp_path, monkeypatch, play)


def test_a_link_is_open_at_one_page_and_ends_when_the_host_takes_it_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(room: GuestRoom) -> None:
        link = room.invited()
        async with room.opened(link) as page:
            await page.enter()
            async with room.opened(link) as second:
                assert await second.code() == guests.TAKEN
            await room.until(lambda: "guest-1" in room.moved, "the first page goes on")
            assert withdraw(room.paths.run, "guest-1")
            assert await page.code() == guests.ENDED
        await room.until(lambda: room.heard[-1].left, "the guest has left")

    in_room(tmp_path, monkeypatch, play)


def test_what_a_guest_cannot_do_is_not_passed_on_and_ends_the_visit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    beyond = posture_record(yaw=3.0)
    wrong = (beyond, guest_record("Ben", "builtin:person=ben"), b"", b"\xff" * 26, json.dumps({"person": "../x"}), "no JSON", "[1]")

    async def play(room: GuestRoom) -> None:
        async with room.opened(room.invited()) as page:
            await page.enter()
            await page.socket.send_bytes(SITS)
            for said in wrong[: guests.MOST_FAULTY]:
                await (page.socket.send_str(said) if isinstance(said, str) else page.socket.send_bytes(said))
            await room.until(lambda: "guest-1" in room.moved, "the guest is still there")
            for _ in range(guests.MOST_FAULTY):
                await page.socket.send_bytes(beyond)
            assert await page.code() == guests.MISBEHAVED
        await room.until(lambda: room.heard[-1].left, "the guest has left")
        assert {m.guest.display_name for m in room.pointed if m.HasField("guest")} == {"Ann", ""}
        assert all(abs(m.head_yaw) < 2.2 for m in room.pointed)

    in_room(tmp_path, monkeypatch, play)


def test_a_page_that_came_back_and_moves_before_it_has_said_again_as_whom_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        async with room.opened(room.invited()) as page:
            await page.told("invited")
            for _ in range(3 * guests.MOST_FAULTY):
                await page.socket.send_bytes(SITS)
            await page.socket.send_bytes(voice_record(room.clock.now_ns(), HUM))
            await page.socket.send_json({"person": "carla"})
            await page.socket.send_bytes(posture_record(yaw=0.5))
            await room.until(lambda: "guest-1" in room.moved, "the guest is in the room")
        room.take()
        assert not room.spoken, "what was said before is left out"

    in_room(tmp_path, monkeypatch, play)


def test_a_page_that_sends_a_thousand_messages_a_second_is_closed_and_nobody_gets_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        async with room.opened(room.invited("guest-2", "Mallory")) as flood, room.opened(room.invited()) as page:
            await flood.enter()
            await page.enter()
            for _ in range(1000):
                await flood.socket.send_bytes(posture_record(gesture=PointerFrame.GESTURE_WAVE))
            assert await flood.code() == guests.MISBEHAVED
            await room.until(lambda: "guest-1" in room.moved, "the other guest")
        got = [m for m in room.pointed if m.device == "guest-2-pointer" and not m.HasField("guest")]
        assert len(got) <= guests.MOST_A_SECOND

    in_room(tmp_path, monkeypatch, play)


def test_what_a_page_sent_while_the_gateway_was_held_up_comes_at_once_and_is_no_flood(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        async with room.opened(room.invited()) as page:
            await page.enter()
            for _ in range(guests.MOST_A_SECOND + 50):
                await page.socket.send_bytes(SITS)
            await room.until(lambda: "guest-1" in room.moved, "the guest is in the room")
            await page.socket.send_bytes(posture_record(yaw=0.5))
            await room.until(lambda: any(m.head_yaw > 0.4 for m in room.pointed), "the guest is heard")

    in_room(tmp_path, monkeypatch, play)


def test_a_message_too_large_ends_the_visit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(room: GuestRoom) -> None:
        async with room.opened(room.invited()) as page:
            await page.enter()
            await page.socket.send_bytes(bytes(10_000))
            assert await page.code() == aiohttp.WSCloseCode.MESSAGE_TOO_BIG

    in_room(tmp_path, monkeypatch, play)


def test_a_link_opens_the_guests_page_and_figures_and_nothing_else_of_a_console_with_a_token(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        link = room.invited()
        wanted = {"/join": 200, "/join.css": 200, "/": 403, "/live": 403, "/console.css": 403, f"/asset/{'0' * 32}.glb": 403}
        async with aiohttp.ClientSession() as session:
            for path, status in wanted.items():
                async with session.get(f"http://{room.address}{path}") as answer:
                    assert answer.status == status, path
            for shown, status in ((link, 404), (link + "x", 403)):
                headers = {"Authorization": f"Bearer {shown}"}
                async with session.get(f"http://{room.address}/asset/{'0' * 32}.glb", headers=headers) as answer:
                    assert answer.status == status
                async with session.get(f"http://{room.address}/live", headers=headers) as answer:
                    assert answer.status == 403
            for of_another in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}):
                async with session.get(f"http://{room.address}/guest", headers=of_another) as answer:
                    assert answer.status == 403

    in_room(tmp_path, monkeypatch, play, console=ConsoleConfig(at="127.0.0.1:0", token="0123456789abcdef"))


def test_pages_that_show_no_link_are_bounded_and_let_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guests, "_PATIENCE_S", 5.0)  # within which a busy machine opens so many

    async def play(room: GuestRoom) -> None:
        async with aiohttp.ClientSession() as session:
            silent = [await session.ws_connect(f"http://{room.address}/guest") for _ in range(guests.MOST_STRANGERS)]
            async with session.get(f"http://{room.address}/guest") as answer:
                assert answer.status == 503
            for socket in silent:
                while not (await socket.receive()).type & aiohttp.WSMsgType.CLOSE:
                    pass
            monkeypatch.setattr(guests, "_PATIENCE_S", 1e6)  # however long this page takes
            async with room.opened(room.invited()) as page:
                await page.told("invited")

    in_room(tmp_path, monkeypatch, play)


def test_guesses_at_links_are_few_at_a_time_and_no_line_and_no_file_holds_what_was_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(guests, "_GUESS_S", 1e6)  # until the end of this test; twenty a second otherwise
    guessed = [f"a-guess-{n:02d}" for n in range(guests.MOST_STRANGERS)]
    caplog.set_level("DEBUG")

    async def play(room: GuestRoom) -> None:
        link = room.invited()
        async with room.opened(link) as page:
            await page.enter()
            async with aiohttp.ClientSession() as session:
                for token in guessed:
                    await (await session.ws_connect(f"http://{room.address}/guest")).send_json({"token": token})
                async with session.get(f"http://{room.address}/guest") as answer:
                    assert answer.status == 503
            await page.socket.send_bytes(SITS)
            await room.until(lambda: "guest-1" in room.moved, "who is in the room stays there")
        lines = [record.getMessage() for record in caplog.records]
        kept = [file.read_text("utf-8", "replace") for file in tmp_path.rglob("*") if file.is_file()]
        assert kept and any("event=guest_came" in line for line in lines)
        for token in (link, *guessed):
            assert not any(token in text for text in (*lines, *kept))

    in_room(tmp_path, monkeypatch, play)


HUM = Encoder(1).encode((0.2 * np.sin(np.arange(FRAME) * 0.03)).astype(np.float32))


async def speak(room: GuestRoom, page: GuestPage, frames: int = 10) -> None:
    now_ns = room.clock.now_ns()
    for n in range(frames):
        await page.socket.send_bytes(voice_record(now_ns - (frames - n) * FRAME_NS, HUM))


def test_a_guests_voice_is_published_as_theirs_once_they_are_in_the_room_and_heard_by_others_never_by_themselves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def hears(page: GuestPage, came: list[bytes]) -> None:
        async for said in page.socket:
            if said.type is aiohttp.WSMsgType.BINARY and said.data[0] == FORMAT:
                came.append(said.data)

    async def play(room: GuestRoom) -> None:
        by_ann, by_bob = list[bytes](), list[bytes]()
        async with room.opened(room.invited()) as ann, room.opened(room.invited("guest-2", "Bob")) as bob:
            await bob.socket.send_json({"hear": True})  # before he is in the room: nothing for him
            for page in (ann, bob):
                await page.told("invited")
            await speak(room, ann, 3)  # before she is
            await ann.socket.send_json({"person": "carla"})
            await bob.socket.send_json({"person": "ben"})
            for page in (ann, bob):
                await page.socket.send_json({"hear": True})
            await speak(room, ann)
            await room.until(lambda: room.spoken, "what she said in the room")
            assert len(room.spoken) <= 10, "what she said at the door is no part of it"
            async with asyncio.TaskGroup() as pages:
                hearing = [pages.create_task(hears(ann, by_ann)), pages.create_task(hears(bob, by_bob))]
                while not by_bob:  # what was said before a page could hear is not said again
                    await speak(room, ann, 1)
                    await asyncio.sleep(FRAME_NS / 1e9)  # a page that sends more at once is sent away
                room.take()
                assert {name for name, _ in room.spoken} == {"guest-1"} and room.spoken[-1][1].opus == HUM
                while not by_ann:
                    await speak(room, bob, 1)
                    await asyncio.sleep(FRAME_NS / 1e9)
                for task in hearing:
                    task.cancel()
        assert all(b"guest-1" in data for data in by_bob) and all(b"guest-2" in data and b"guest-1" not in data for data in by_ann)

    in_room(tmp_path, monkeypatch, play)


def test_a_voice_that_none_of_ours_sends_reaches_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(room: GuestRoom) -> None:
        async with room.opened(room.invited()) as page:
            await page.enter()
            now_ns = room.clock.now_ns()
            for record in (
                voice_record(now_ns + 3_600_000_000_000, HUM),  # from the future
                voice_record(now_ns, bytes(MOST_PACKET_BYTES + 1)),
                voice_record(0, HUM)[:4] + b"\xff" * 8 + HUM,  # at no time
                voice_record(now_ns, b""),
                voice_record(now_ns - 60_000_000_000, HUM),  # of a minute ago
                *(voice_record(now_ns, HUM) for _ in range(5)),  # the same again and again: once
                *(voice_record(now_ns + n * FRAME_NS // 10, b"\x18" + bytes(40)) for n in range(10, 15)),  # Opus, but of 60 ms
            ):
                await page.socket.send_bytes(record)
            await speak(room, page, 1)
            await page.socket.send_bytes(SITS)
            await room.until(lambda: room.spoken and "guest-1" in room.moved, "what is in order")
            assert len(room.spoken) <= 2 and all(m.opus == HUM for _, m in room.spoken)
            for _ in range(guests.MOST_FAULTY):
                await page.socket.send_bytes(voice_record(now_ns + 3_600_000_000_000, HUM))
            assert await page.code() == guests.MISBEHAVED

    in_room(tmp_path, monkeypatch, play)


def test_a_thousand_packets_of_a_voice_at_once_end_the_visit_and_few_are_passed_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        async with room.opened(room.invited()) as page:
            await page.enter()
            begun_ns = room.clock.now_ns() - 1_000_000_000
            for n in range(1000):
                await page.socket.send_bytes(voice_record(begun_ns + n * FRAME_NS, HUM))
            assert await page.code() == guests.MISBEHAVED
            await room.until(lambda: room.spoken, "some")
        assert len(room.spoken) < 130

    in_room(tmp_path, monkeypatch, play)


def test_a_guest_writes_to_all_in_their_own_name_and_no_more_than_a_person_types(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        chat = Chat(room.network.bus("c", "hub", room.clock))
        async with room.opened(room.invited()) as page, room.opened(room.invited("guest-2", "Bob")) as other:
            await page.told("invited")
            await page.socket.send_json({"write": "from the door"})  # who has not entered is not heard
            await page.socket.send_json({"person": "ben"})
            await other.enter("carla")
            async with other.listening():
                for n in range(MOST_LINES + 5):
                    await page.socket.send_json({"write": f"<b>line {n}</b>\n\u202e"})
                await page.socket.send_json({"write": "x" * 301})
                await page.socket.send_json({"write": {"text": "no text"}})
                await until(lambda: "chat" in other.newest and "line 19" in json.dumps(other.newest["chat"]), "the lines")
                lines = other.newest["chat"]["lines"]
        assert {line["who"] for line in lines} == {"guest-1"}
        assert [line["text"] for line in lines] == [f"<b>line {n}</b>" for n in range(MOST_LINES)]
        chat.take()
        assert len(chat.lines) == MOST_LINES

    in_room(tmp_path, monkeypatch, play)


BODY_SEEN = Seen([(0.02 * n, 0.0, 0.0) for n in range(len(BODY))])


def test_what_a_guests_camera_sees_is_theirs_and_what_no_camera_sees_is_not_passed_on_and_ends_the_visit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        def seen(later_ns: int = 0) -> bytes:
            return camera_record(room.clock.now_ns() + later_ns, BODY_SEEN)

        def wrong(right: bytes) -> tuple[bytes, ...]:
            return (
                seen(3_600_000_000_000),  # from the future
                seen(-60_000_000_000),  # of a minute ago
                right[:-1],
                right[:3] + b"\xff" + right[4:],
                right[:12] + b"\x00\x80" + right[14:],  # far beside the picture
                right[:4] + b"\xff" * 8 + right[12:],  # at no time
            )

        await visit_with_faults(room, seen, wrong, room.seen)
        assert [m.device for m in room.seen] == ["guest-1-camera"] and len(room.seen[0].body) == 3 * len(BODY)

    in_room(tmp_path, monkeypatch, play)


def test_a_camera_of_a_thousand_pictures_a_second_ends_the_visit_and_few_are_passed_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        await visit_with_a_flood(room, lambda: camera_record(room.clock.now_ns(), BODY_SEEN), room.seen)

    in_room(tmp_path, monkeypatch, play)


def test_what_finds_landmarks_is_served_from_here_alone_and_nothing_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "page"
    (folder / "landmarks").mkdir(parents=True)
    (folder / "landmarks/camera_worker.js").write_text("worker")
    (folder / "secret").write_text("no")
    monkeypatch.setattr(landmarks, "FOLDER", folder)

    async def play(room: GuestRoom) -> None:
        async with aiohttp.ClientSession() as session:
            async with session.get(f"http://{room.address}/landmarks/camera_worker.js") as answer:
                assert (answer.status, await answer.text(), answer.content_type) == (200, "worker", "text/javascript")
                policy = answer.headers["Content-Security-Policy"]
                assert "connect-src 'self'" in policy and "http" not in policy and "unsafe-inline" not in policy
            for beside in ("/landmarks/..%2fsecret", "/landmarks/%2e%2e/secret", "/landmarks/other.js", "/landmarks/"):
                async with session.get(URL(f"http://{room.address}{beside}", encoded=True)) as answer:
                    assert answer.status == 404, beside

    in_room(tmp_path, monkeypatch, play, console=ConsoleConfig(at="127.0.0.1:0", token="0123456789abcdef"))

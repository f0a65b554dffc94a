"""What guests say without their voice comes through gateway, site and world, to whom it is meant: private lines, a raised hand,
reactions, and what was said to the room."""

from __future__ import annotations

import asyncio
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from guest_room import GuestPage, GuestRoom, in_room
from waiting import until

from vistel.session.chat import Chat
from vistel.v1.speech_pb2 import Utterance
from vistel.wire.topics import BY_NAME
from vistel_services.console import guests
from vistel_services.world.service import warm_up

TOKYO: dict[str, Any] = {"name": "tokyo", "participants": [{"name": "aiko"}]}


async def refused(room: GuestRoom, who: str) -> None:
    """The world has refused what a guest said to the room."""
    said = Utterance(participant=who, text="undo", spoken="undo", state=Utterance.STATE_REFUSED, reply="nothing")
    said.header.t_ns = room.clock.now_ns()
    room.network.bus("c", "guests", room.clock).publish(BY_NAME["utterance"], participant=who).put(said)


def lines(page: GuestPage) -> list[tuple[str, str, str]]:
    return [(n["who"], n["to"], n["text"]) for n in page.newest.get("private", {"lines": []})["lines"]]


def test_a_private_line_is_told_to_its_two_guests_alone_and_to_nobody_who_has_the_seat_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        hub = room.network.bus("c", "hub", room.clock)
        to_all, private = Chat(hub), Chat(hub, "private_line", reader_site="tokyo")
        ann, bob = room.invited(), room.invited("guest-2", "Bob")
        async with room.opened(ann) as page, room.opened(bob) as other:
            await page.enter()
            await other.enter("ben")
            async with page.listening(), other.listening():
                await page.socket.send_json({"write": "the next one is yours", "to": "guest-2"})
                await page.socket.send_json({"write": "for aiko", "to": "aiko"})
                await until(lambda: len(lines(page)) == 2, "the writer's own lines")
                await until(lambda: lines(other), "the reader's line")
                await other.socket.send_json({"write": "to all"})
                await until(lambda: "chat" in page.newest and page.newest["chat"]["lines"], "a line to all")
                assert lines(other) == [("guest-1", "guest-2", "the next one is yours")]
                assert lines(page) == [*lines(other), ("guest-1", "aiko", "for aiko")]
                assert [n["text"] for n in page.newest["chat"]["lines"]] == ["to all"]
        assert [n.text for n in private.take()] == ["for aiko"] and [n.text for n in to_all.take()] == ["to all"]
        async with room.opened(bob) as again:  # loads the page anew
            await again.enter("ben")
            async with again.listening():
                await until(lambda: lines(again), "his line")
        async with room.opened(room.invited("guest-2", "Eve")) as later:
            await later.enter("ben")
            async with later.listening():
                await until(lambda: "private" in later.newest and "chat" in later.newest, "all that she may read")
                assert lines(later) == []

    async def visit() -> None:
        async with GuestRoom(tmp_path, None, TOKYO).serving(monkeypatch) as room:
            await play(room)

    asyncio.run(visit())


def test_what_a_guest_cannot_write_privately_is_not_passed_on_and_ends_the_visit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def play(room: GuestRoom) -> None:
        hub = room.network.bus("c", "hub", room.clock)
        chats = Chat(hub), Chat(hub, "private_line")
        wrong: list[object] = ["nobody", "guest-1", "guest-2/x", "*", "x" * 500, 7, None, ["guest-2"], {"a": 1}, "**", "hub"]
        assert len(wrong) > guests.MOST_FAULTY
        async with room.opened(room.invited()) as page:
            await page.enter()
            for to in wrong:
                await page.socket.send_json({"write": "hello", "to": to})
            assert await page.code() == guests.MISBEHAVED
        assert [chat.take() for chat in chats] == [[], []]

    in_room(tmp_path, monkeypatch, play)


def test_hands_and_reactions_of_guests_are_told_in_their_order_and_captions_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    warm_up()  # else the loop stands still while this process compiles, and who asks the world waits for no answer so long

    async def play(room: GuestRoom) -> None:
        async with room.led() as leading, room.opened(room.invited()) as page, room.opened(room.invited("guest-2", "Bob")) as other:
            await page.enter()
            await other.enter("ben")
            async with page.listening(), other.listening():

                def signals(of: GuestPage, kind: str) -> list[list[object]]:
                    return of.newest.get("signals", {"raised": [], "reactions": []})[kind]

                await until(lambda: all(map(page.in_the_world, ("guest-1", "guest-2"))), "both sit in the room", tasks=[leading])
                for who, number in ((other, 1), (page, 2)):
                    await who.socket.send_json({"hand_down": False})
                    await until(lambda n=number: len(signals(page, "raised")) == n, "a hand", tasks=[leading])
                assert signals(page, "raised") == [["guest-2", False], ["guest-1", False]]
                laughs = partial(page.socket.send_json, {"react": "laugh"})
                await other.shown("signals", lambda words: words["reactions"] == [["guest-1", "laugh"]], laughs, [leading])
                await until(lambda: not signals(other, "reactions"), "it is over", tasks=[leading])
                await other.socket.send_json({"hand_down": True})
                await until(lambda: signals(page, "raised") == [["guest-1", False]], "it is down", tasks=[leading])
                row = {"who": "Bob", "text": "undo", "mark": "✗", "reply": "nothing"}
                await page.shown("captions", lambda words: words["captions"] == [row], partial(refused, room, "guest-2"), [leading])
                faulty: list[object] = ["tears", "", 3, [], {}, None, "CLAP", "thumb up", True, "x" * 900, "wave"]
                for react in faulty:
                    await page.socket.send_json({"react": react})
                await until(lambda: page.socket.closed, "the visit has ended", tasks=[leading])
                assert page.socket.close_code == guests.MISBEHAVED

    in_room(tmp_path, monkeypatch, play)

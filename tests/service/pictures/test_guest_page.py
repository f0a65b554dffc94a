"""The page for guests in a real browser: a link, a person chosen, and the guest is in the room and does what mouse and keys say."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Page, page
from guest_room import GuestRoom, at_the_door
from waiting import until

from vistel.v1.device_pb2 import PointerFrame
from vistel_services.console import bundle
from vistel_services.world.service import warm_up

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")

CHOOSE_READER = (
    "(at => (at.value = 'guest-2', at.dispatchEvent(new Event('change', { bubbles: true })), at.value))"
    "(document.querySelector('#chat select'))"
)
BARE = "places => places.findLast(([x, y]) => document.elementFromPoint(x, y)?.id === 'room')"
"""Of places on the page, a highest one at which there is the picture and no button."""


def palms(room: GuestRoom) -> np.ndarray:
    """(N, 3) where the hand that is led now has been led."""
    led = [
        f.left if f.HasField("left") else f.right if f.HasField("right") else None for f in room.pointed if not f.HasField("guest")
    ]
    last = next((n for n, hand in enumerate(reversed(led)) if hand is None), len(led))
    return np.array([(hand.palm.x, hand.palm.y, hand.palm.z) for hand in led[len(led) - last :] if hand is not None])


async def mouse(tab: Page, kind: str, at: list[float], **more: Any) -> None:
    await tab.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], **more)


async def led_soon(room: GuestRoom, newest: Callable[[GuestRoom], PointerFrame], looks: int) -> bool:
    """Whether a hand is led within some pictures of the page."""
    for _ in range(looks):
        room.take()
        if newest(room).HasField("left") or newest(room).HasField("right"):
            return True
        await asyncio.sleep(0.1)  # the page sends when it draws
    return False


async def entered(tab: Page, room: GuestRoom, link: str) -> None:
    await at_the_door(tab, room, link, 480, 320)
    assert "Welcome, Ann" in await tab.value("document.body.innerText")
    await tab.click(".people button[aria-current=true]")
    await tab.until("window.guest.me() === 'guest-1'")


def test_a_guest_opens_the_link_enters_looks_waves_touches_and_rests(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")

    def newest(room: GuestRoom) -> PointerFrame:
        return next(m for m in reversed(room.pointed) if m.device == "guest-1-pointer" and not m.HasField("guest"))

    async def visit() -> None:
        async with (
            page(tmp_path, *SOFTWARE_GL) as tab,
            GuestRoom(tmp_path).serving(monkeypatch) as room,
            room.opened(room.invited("guest-2", "Bob")) as other,
            contextlib.AsyncExitStack() as there,
        ):
            await other.enter("ben")
            await there.enter_async_context(other.listening())
            await entered(tab, room, room.invited())
            assert {m.participant for m in room.heard if not m.left} <= {"guest-1", "guest-2"}
            low = await tab.value("document.getElementById('does').offsetHeight / innerHeight")
            assert 0.0 < low < 0.25, "the buttons of a low page leave the others in sight"
            await tab.until("window.guest.joints('guest-2').length > 0")
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="w")
            await room.until(lambda: newest(room).gesture == PointerFrame.GESTURE_WAVE, "a wave")
            before = newest(room).head_yaw
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowLeft")
            await room.until(lambda: newest(room).head_yaw > before + 0.05, "the head turns")
            # Until a press meets the other person, who must be in sight and behind no button. The view follows the figure's eyes by
            # and by, so that where they were seen may be empty when the press comes.
            for looks in itertools.count(30, 10):  # a slow page is given longer the next time
                x, _ = await tab.value("window.guest.seen(window.guest.joints('guest-2')[9])")
                if at := await tab.value(f"({BARE})(window.guest.joints('guest-2').slice(5, 11).map(window.guest.seen))"):
                    await mouse(tab, "mousePressed", at, button="left", buttons=1, clickCount=1)
                    if await led_soon(room, newest, looks):
                        break
                    await mouse(tab, "mouseReleased", at, button="left", clickCount=1)
                else:
                    await tab.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowLeft" if x < 240 else "ArrowRight")
                await asyncio.sleep(0.2)  # the page draws when it does
            led = newest(room)
            assert at and (led.HasField("left") or led.HasField("right")), "a hand is led"
            assert not (led.left.close or led.right.close)  # people are touched, not taken
            await room.until(lambda: len(palms(room)) > 60, "the hand is led on")
            assert np.ptp(palms(room), axis=0).max() < 2e-3, "it goes to what was pressed, however the view moves meanwhile"
            await mouse(tab, "mouseReleased", at, button="left", clickCount=1)
            await room.until(lambda: not (newest(room).HasField("left") or newest(room).HasField("right")), "the hand rests")
            # The letters of a line are no gestures; its addresses can be followed, and what looks like a page's code is text.
            waved = newest(room).gesture_number
            for n in range(12):
                await other.socket.send_json({"write": f"line {n}"})
            await tab.until("document.querySelector('#chat-button b')?.innerText === '12'")
            await tab.click("#chat-button")
            await tab.until("document.querySelectorAll('#chat .lines li').length === 12")
            assert await tab.value(
                "(at => at.scrollHeight > at.clientHeight && at.scrollTop)(document.querySelector('#chat .lines'))"
            )
            beside = "(([a, b]) => a.right <= b.left || a.bottom <= b.top)"
            boxes = "['chat', 'room'].map(id => document.getElementById(id).getBoundingClientRect())"
            assert await tab.value(f"{beside}({boxes})"), "nobody in the room is behind it"
            await other.socket.send_json({"write": "<img src=x> see https://example.org/a?b=1"})
            await tab.until("document.querySelector('#chat .lines a')?.href === 'https://example.org/a?b=1'")
            assert await tab.value("document.querySelector('#chat img')") is None
            await tab.value("document.querySelector('#chat input').focus()")
            for letter in "wow":
                await tab.call("Input.dispatchKeyEvent", type="keyDown", key=letter, text=letter)
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="Enter", text="\r")
            await tab.until("document.querySelector('#chat .lines').innerText.includes('wow')")
            # To Bob alone, and he answers so.
            assert await tab.value(CHOOSE_READER) == "guest-2"
            await tab.until("document.querySelector('#chat input').placeholder === 'Write to Bob alone'")
            await tab.value("document.querySelector('#chat input').focus()")
            for letter in "psst":
                await tab.call("Input.dispatchKeyEvent", type="keyDown", key=letter, text=letter)
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="Enter", text="\r")
            await tab.until("document.querySelector('#chat .lines .alone')?.innerText.includes('to Bob alone')")
            await until(lambda: "private" in other.newest, "the line to Bob alone")
            assert [(n["to"], n["text"]) for n in other.newest["private"]["lines"]] == [("guest-2", "psst")]
            assert all(n["text"] != "psst" for n in other.newest["chat"]["lines"])
            await other.socket.send_json({"write": "what?", "to": "guest-1"})
            await tab.until("[...document.querySelectorAll('#chat .lines .alone')].at(-1).innerText.includes('what?')")
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="Escape")
            await tab.until("document.getElementById('chat').hidden")
            assert newest(room).gesture_number == waved
            # In the background it says nothing, and the guest stays.
            await tab.value("Object.defineProperty(document, 'hidden', { get: () => true }) && 1")
            sent = await tab.value("window.guest.sent()")
            room.take()
            room.moved.clear()
            await room.until(lambda: room.moved.count("guest-1") > 120, "the figure lives on")
            assert await tab.value("window.guest.sent()") <= sent + 26
            assert not [m.participant for m in room.heard if m.left]
            await tab.call("Page.navigate", url="about:blank")
            await room.until(lambda: any(m.left and m.participant == "guest-1" for m in room.heard), "the guest has left")
            assert not [m for m in tab.messages if "Error" in m], tab.messages

    asyncio.run(visit())


def test_a_wrong_link_says_what_to_do(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")

    async def visit() -> None:
        async with page(tmp_path, *SOFTWARE_GL) as tab, GuestRoom(tmp_path).serving(monkeypatch) as room:
            for link, says in (("#wrong", "Ask the host for a link"), ("", "Open the whole link")):
                await tab.call("Page.navigate", url="about:blank")
                await tab.open(f"http://{room.address}/join{link}", 480, 320)
                await tab.until(f"document.getElementById('trouble').innerText.includes({says!r})")

    asyncio.run(visit())


def test_a_guest_raises_a_hand_and_reacts_and_sees_those_of_others(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")
    warm_up()  # else the loop stands still while this process compiles, and who asks the world waits for no answer so long

    async def visit() -> None:
        async with (
            page(tmp_path, *SOFTWARE_GL) as tab,
            GuestRoom(tmp_path).serving(monkeypatch) as room,
            room.opened(room.invited("guest-2", "Bob")) as other,
            room.led() as leading,
        ):
            await other.enter("ben")
            async with other.listening() as listens:
                parts = [leading, listens]

                def told(kind: str) -> list[list[object]]:
                    return other.newest.get("signals", {"raised": [], "reactions": []})[kind]

                await entered(tab, room, room.invited())
                await until(lambda: all(map(other.in_the_world, ("guest-1", "guest-2"))), "both sit in the room", tasks=parts)
                await tab.call("Input.dispatchKeyEvent", type="keyDown", key="r")
                await until(lambda: told("raised") == [["guest-1", False]], "the hand is up", tasks=parts)
                await tab.until("document.getElementById('raise').getAttribute('aria-pressed') === 'true'")
                await other.socket.send_json({"hand_down": False})
                label = "[...document.querySelectorAll('.label')].find(l => l.innerText.includes('Bob'))?.innerText"
                while not await tab.value(f"{label}?.includes('hand up 2 · claps')"):
                    await other.socket.send_json({"react": "clap"})  # again: a busy page draws too late to show one
                    await asyncio.sleep(1.1)  # the world takes one a second
                await tab.until(f"{label}?.includes('hand up 2') && !{label}.includes('claps')")
                await tab.value("document.querySelector('#reactions summary').click()")
                await tab.until("document.querySelector('#reactions').open")
                heart = partial(tab.value, "document.getElementById('react-heart').click()")
                await heart()
                assert not await tab.value("document.querySelector('#reactions').open")
                await other.shown("signals", lambda words: words["reactions"] == [["guest-1", "heart"]], heart, parts)
                await until(lambda: not told("reactions"), "it is over", tasks=parts)
                key = partial(tab.call, "Input.dispatchKeyEvent", type="keyDown", key="5")
                await other.shown("signals", lambda words: words["reactions"] == [["guest-1", "surprise"]], key, parts)
                await tab.click("#raise")
                await until(lambda: told("raised") == [["guest-2", False]], "it is down", tasks=parts)
                assert not [m for m in tab.messages if "Error" in m], tab.messages

    asyncio.run(visit())

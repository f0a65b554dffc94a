"""The page for guests with a headset, in a real browser: npm's iwer is the headset, its controllers and its hands."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path

import numpy as np
import pytest
from browser import Page, page
from guest_room import GuestRoom, at_the_door, figure_near, place

from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.messages.world.decode import person
from vistel.protocol.pages.headset import JOINTS, TURN, UNIT_M
from vistel.v1.speech_pb2 import Utterance
from vistel.wire.topics import BY_NAME
from vistel_services.console import bundle

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
WEB = Path(__file__).resolve().parents[3] / "clients/web"
IWER = WEB / "node_modules/iwer/build/iwer.min.js"
WORN = "window.worn = new IWER.XRDevice(IWER.metaQuest3); worn.stereoEnabled = true; worn.installRuntime({ forceInstall: true })"
HELD = "worn.controllers.left"
TURNED_ABOUT = np.array((-1.0, 1.0, -1.0))
"""Axes of a headset's space in those of the seat it was centred on: WebXR's look along -Z, seats along +Z."""
THUMB_TIP, INDEX_TIP = 4, 9
REMEMBER = """(() => {
  window.signs = [];
  window.replies = [];
  setInterval(() => {
    const { headset } = window.guest;
    for (const [seen, now] of [[window.signs, headset.signOf("guest-2")], [window.replies, headset.saidToRoom()]])
      if (seen.at(-1) !== now) seen.push(now);
  }, 20);
  return true;
})()"""
"""JavaScript: from now on the page keeps what has stood over Eve's head and below where the guest looks, which goes by itself."""


def skip_without_page_and_headset() -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")
    if not IWER.is_file():
        pytest.skip("iwer is not in clients/web/node_modules (make web)")


async def with_a_headset(tab: Page, room: GuestRoom) -> None:
    """Ann has a headset, opens her link, and chooses her person."""
    await tab.call("Page.addScriptToEvaluateOnNewDocument", source=f"{IWER.read_text('utf-8')};{WORN}; 0")
    await at_the_door(tab, room, room.invited(), 320, 200)
    await tab.click(".people button[aria-current=true]")


def yaw(head: object) -> float:
    """Where a head looks, from where the seat faces [degrees]."""
    way = -matrix_from_quaternion(np.array(list(head)[3:]) / TURN)[:, 2]  # type: ignore[call-overload]
    return math.degrees(math.atan2(way[0], way[2]))


def tips_apart(joints: object) -> float:
    """Of thumb and index finger [m]."""
    at = np.reshape(list(joints), (JOINTS, 3)) * UNIT_M  # type: ignore[call-overload]
    return float(np.linalg.norm(at[THUMB_TIP] - at[INDEX_TIP]))


def eyes_from_head(room: GuestRoom) -> np.ndarray:
    """Of the guest, who looks ahead [m]. Their own eyes are not drawn, and so have no place on the page."""
    own = person("guest-1", room.heard[-1]).proportions
    assert own is not None
    rest = own.skeleton.rest
    return np.mean([rest[JOINT_INDEX[f"{s}_eye"]] for s in ("left", "right")], axis=0) - rest[JOINT_INDEX["head"]]


def test_a_guest_enters_with_a_headset_moves_pinches_turns_takes_it_off_and_leaves(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    skip_without_page_and_headset()

    async def visit() -> None:
        async with page(tmp_path, *SOFTWARE_GL) as tab, GuestRoom(tmp_path).serving(monkeypatch) as room:
            await with_a_headset(tab, room)
            await tab.until("window.guest.me() === 'guest-1'")
            await tab.until("document.querySelector('#headset')?.innerText === 'Enter with a headset'")
            await tab.click("#headset")
            await tab.until("window.guest.headset.state === 'on'")
            await room.until(lambda: room.worn and room.worn[-1].head, "the head")
            assert abs(yaw(room.worn[-1].head)) < 0.1, "who enters looks where the seat faces"
            begins = place(room.worn[-1].head)
            assert abs(begins[0]) < 0.1 and 1.0 < begins[1] < 1.4, "out of the figure's eyes"

            # The head goes where the headset is told to go, to the millimetre; and the figure with it.
            moved = np.array((0.06, -0.05, -0.08))
            await tab.value(f"[worn.position.x += {moved[0]}, worn.position.y += {moved[1]}, worn.position.z += {moved[2]}]")
            wanted = begins + TURNED_ABOUT * moved
            await room.until(lambda: np.abs(place(room.worn[-1].head) - wanted).max() < 0.001, "the head has moved")
            eyes = place(room.worn[-1].head)

            # Hands: to the millimetre, and the fingers by their own joints.
            await tab.value(
                "(worn.primaryInputMode = 'hand', worn.hands.right.position.set(0.2, 1.3, -0.35),"
                " worn.hands.left.position.set(-0.2, 1.4, -0.35), 1)"
            )
            await room.until(lambda: len(room.worn[-1].left.joints) == len(room.worn[-1].right.joints) == 3 * JOINTS, "both hands")
            await room.until(lambda: place(room.worn[-1].left.joints)[1] > place(room.worn[-1].right.joints)[1] + 0.09, "there")
            right, opened = place(room.worn[-1].right.joints), tips_apart(room.worn[-1].right.joints)
            await tab.value("worn.hands.right.position.set(0.23, 1.34, -0.37), 1")
            wanted = right + TURNED_ABOUT * (0.03, 0.04, -0.02)
            await room.until(lambda: np.abs(place(room.worn[-1].right.joints) - wanted).max() < 0.001, "the hand has moved")
            await figure_near(tab, room, "right_hand", wanted, 0.03)
            await figure_near(tab, room, "head", eyes - eyes_from_head(room), 0.03)
            await tab.value("worn.hands.right.updatePinchValue(1), 1")
            await room.until(lambda: tips_apart(room.worn[-1].right.joints) < 0.01, "a pinch")
            assert opened > 0.05
            await tab.value("worn.hands.right.updatePinchValue(0), 1")

            # What a headset measures when it has lost its way is left out; the guest stays.
            await tab.value("worn.hands.right.position.set(NaN, 1e9, 0), 1")
            await room.until(lambda: not room.worn[-1].HasField("right"), "no hand")
            assert room.worn[-1].HasField("left") and await tab.value("window.guest.headset.state") == "on"

            # Controllers: a thumbstick turns the seat by a step and, pressed, centres the view.
            await tab.value(f"(worn.primaryInputMode = 'controller', {HELD}.position.set(-0.2, 1.3, -0.3), 1)")
            await room.until(lambda: len(room.worn[-1].left.grip) == 7, "a controller")
            await tab.value(f"({HELD}.updateButtonValue('squeeze', 1), {HELD}.updateAxes('thumbstick', -1, 0), 1)")
            await room.until(lambda: abs(yaw(room.worn[-1].head) - 30.0) < 0.1, "turned to the left, by one step")
            await room.until(lambda: room.worn[-1].left.squeeze == 255, "squeezed")
            assert np.abs(place(room.worn[-1].head) - eyes).max() < 0.001, "about the head"
            await tab.value(f"({HELD}.updateAxes('thumbstick', 0, 0), {HELD}.updateButtonValue('thumbstick', 1), 1)")
            await room.until(lambda: abs(yaw(room.worn[-1].head)) < 0.1, "centred")
            assert np.abs(place(room.worn[-1].head) - begins).max() < 0.001, "where the figure's eyes are at rest"

            # Taken off: the figure rests, and the page says so. Put on again, it goes on.
            await tab.value("worn.updateVisibilityState('hidden'), 1")
            await tab.until("document.querySelector('#headset').innerText.includes('your figure rests')")
            await room.until(lambda: not room.worn[-1].head, "that it is not worn")
            await tab.until(f"window.guest.joints('guest-1')[{JOINT_INDEX['left_hand']}][1] < 0.75")
            await tab.value("worn.updateVisibilityState('visible'), 1")
            await room.until(lambda: room.worn[-1].head, "the head again")
            await tab.until("window.guest.headset.state === 'on'")

            # Out of it again, mouse and keys lead. The emulated headset's picture lies over the page's buttons.
            await tab.value("(document.querySelector('#headset').click(), 1)")
            await tab.until("document.querySelector('#headset').innerText === 'Enter with a headset again'")
            await room.until(lambda: not room.worn[-1].head, "nobody wears it")
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="w")
            await room.until(lambda: room.pointed[-1].gesture == 1, "a wave")
            assert not [m for m in room.heard if m.left] and not [m for m in tab.messages if "Error" in m], tab.messages

    asyncio.run(visit())


def test_inside_a_headset_names_stand_over_heads_and_what_people_write_is_read_there_for_a_while(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    skip_without_page_and_headset()

    async def visit() -> None:
        async with (
            page(tmp_path, *SOFTWARE_GL) as tab,
            GuestRoom(tmp_path).serving(monkeypatch) as room,
            room.opened(room.invited("guest-2", "Eve")) as eve,
        ):
            await eve.enter()
            async with eve.listening():
                await eve.socket.send_json({"write": "before you came"})
                await with_a_headset(tab, room)
                await tab.until("document.querySelector('#chat-button b')?.innerText === '1'")
                await tab.until("document.querySelector('#headset')?.disabled === false")
                await tab.click("#headset")
                await tab.until("window.guest.headset.signOf('guest-2') === 'Eve'")
                assert await tab.value("window.guest.headset.signOf('guest-1')") == "", "nobody sees their own name"
                assert await tab.value(REMEMBER)
                written = f"see {'x' * 60} おはよう"
                await eve.socket.send_json({"write": written})
                await tab.until(f"window.signs.includes('Eve\\n{written}')")
                await tab.until("window.guest.headset.signOf('guest-2') === 'Eve'")
                await eve.socket.send_json({"write": "psst", "to": "guest-1"})
                await tab.until("window.signs.includes('Eve\\n(to you alone) psst')")
                # What was said to the room, and what it answered, by the guest themselves too.
                assert await tab.value("window.guest.headset.saidToRoom()") == ""
                said = Utterance(participant="guest-1", text="undo", spoken="undo", state=Utterance.STATE_REFUSED, reply="not now")
                publication = room.network.bus("c", "guests", room.clock).publish(BY_NAME["utterance"], participant="guest-1")
                while not await tab.value("window.replies.includes('Ann: undo ✗\\nnot now')"):
                    said.header.t_ns = room.clock.now_ns()
                    publication.put(said)  # again: what is shown for some seconds may be over before it is sent
                    await asyncio.sleep(0.5)
                await tab.until("window.guest.headset.saidToRoom() === ''")
                await eve.socket.close()
                await tab.until("window.guest.headset.signOf('guest-2') === ''")
                assert not [m for m in tab.messages if "Error" in m], tab.messages

    asyncio.run(visit())


def test_without_a_headset_the_page_offers_none_and_without_https_it_says_what_it_needs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")

    async def visit() -> None:
        async with page(tmp_path, *SOFTWARE_GL) as tab, GuestRoom(tmp_path).serving(monkeypatch) as room:
            # As a browser behaves where the page has come without https from another machine.
            await tab.call(
                "Page.addScriptToEvaluateOnNewDocument",
                source="Object.defineProperty(window, 'isSecureContext', { get: () => window.secure ?? false });"
                " Object.defineProperty(navigator, 'xr', { get: () => undefined });",
            )
            await at_the_door(tab, room, room.invited(), 320, 200)
            await tab.click(".people button[aria-current=true]")
            await tab.until("document.getElementById('does').innerText.includes('needs a page with https')")
            assert await tab.value("document.querySelector('#headset')") is None
            await tab.value("(window.secure = true, window.guest.headset.look())")
            await tab.until("!document.getElementById('does').innerText.includes('https')")
            assert await tab.value("document.querySelector('#headset')") is None

    asyncio.run(visit())

"""A guest's phone as a wand, in a real browser, whose own developer tools turn the phone."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
import pytest
from browser import Page, page
from guest_room import GuestRoom, at_the_door, figure_near, place

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.protocol.pages.headset import TURN
from vistel_services.console import bundle

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
REACH_M = 0.5
WRIST_M = 0.1
"""From what is in the palm to the wrist, about."""
NEAR_M = 0.002


async def turned(tab: Page, alpha: float, beta: float, gamma: float) -> None:
    """The phone is turned so, in the angles of W3C's DeviceOrientation [degrees]."""
    await tab.call("DeviceOrientation.setDeviceOrientationOverride", alpha=alpha, beta=beta, gamma=gamma)


async def touch(tab: Page, kind: str, *at: float) -> None:
    points = [{"x": at[0], "y": at[1]}] if at else []
    await tab.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)


@contextlib.asynccontextmanager
async def on_a_phone(folder: Path, patch: pytest.MonkeyPatch) -> AsyncIterator[tuple[Page, GuestRoom]]:
    """A guest has opened their link on a phone, and has chosen a person."""
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")
    async with page(folder, *SOFTWARE_GL) as tab, GuestRoom(folder).serving(patch) as room:
        await tab.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
        await at_the_door(tab, room, room.invited(), 320, 480)
        await tab.click(".people button[aria-current=true]")
        await tab.until("document.querySelector('#wand')?.innerText === 'Lead a hand with this phone'")
        yield tab, room


def points(grip: object) -> np.ndarray:
    """Where the fingers of the hand point that holds a controller, in the seat's frame: x to its left, y up, z ahead."""
    return -matrix_from_quaternion(np.array(list(grip)[3:]) / TURN)[:, 1]  # type: ignore[call-overload]


def test_a_phone_leads_the_right_hand_takes_hold_reaches_and_lets_go(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def visit() -> None:
        async with on_a_phone(tmp_path, monkeypatch) as (tab, room):
            await tab.until("window.guest.me() === 'guest-1'")

            # It lies in the hand, its top to the north: that is ahead, wherever the guest sits at home.
            await tab.click("#wand")
            await tab.until("window.guest.wand.state === 'on'")
            await turned(tab, 70.0, 0.0, 0.0)
            await room.until(lambda: room.worn and len(room.worn[-1].right.grip) == 7, "a hand")
            ahead = place(room.worn[-1].right.grip)
            assert not room.worn[-1].HasField("left")
            assert points(room.worn[-1].right.grip) == pytest.approx([0.0, 0.0, 1.0], abs=NEAR_M)

            # Turned to the left and down, the hand goes there, and the figure's hand with it.
            await turned(tab, 100.0, -10.0, 0.0)
            left, down = math.radians(30.0), math.radians(10.0)
            way = np.array([math.sin(left) * math.cos(down), -math.sin(down), math.cos(left) * math.cos(down)])
            wanted = ahead + REACH_M * (way - (0.0, 0.0, 1.0))
            await room.until(lambda: np.abs(place(room.worn[-1].right.grip) - wanted).max() < NEAR_M, "the hand has moved")
            assert points(room.worn[-1].right.grip) == pytest.approx(way, abs=NEAR_M)
            await figure_near(tab, room, "right_hand", wanted - WRIST_M * way, 0.07)

            # A finger on the picture takes hold, slid up it reaches farther, and away it lets go.
            await touch(tab, "touchStart", 160, 200)
            await room.until(lambda: room.worn[-1].right.trigger == room.worn[-1].right.squeeze == 255, "it takes hold")
            await touch(tab, "touchMove", 160, 150)
            await room.until(lambda: (place(room.worn[-1].right.grip) - wanted) @ way > 0.04, "it reaches farther")
            await touch(tab, "touchEnd")
            await room.until(lambda: room.worn[-1].right.trigger == 0, "it lets go")

            # Where it points now becomes ahead; then it is a phone again, and the figure rests.
            await tab.click("#wand-centre")
            await room.until(lambda: abs(points(room.worn[-1].right.grip)[0]) < NEAR_M, "ahead")
            await tab.click("#wand")
            await room.until(lambda: not room.worn[-1].head, "nobody holds it")
            assert not [m for m in tab.messages if "Error" in m], tab.messages

    asyncio.run(visit())


def test_a_phone_whose_sensors_say_nothing_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    async def visit() -> None:
        async with on_a_phone(tmp_path, monkeypatch) as (tab, room):
            await tab.click("#wand")
            await tab.until("document.querySelector('#wand').innerText.includes('sensors say nothing')")
            room.take()
            assert not any(m.HasField("right") for m in room.worn)
            await turned(tab, 0.0, 0.0, 0.0)
            await room.until(lambda: room.worn and room.worn[-1].HasField("right"), "they speak after all")

    asyncio.run(visit())

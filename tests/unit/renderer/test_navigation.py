"""Looking about and walking at a window, and a 3D mouse's reports."""

from __future__ import annotations

import asyncio
import math
import sys
import threading
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from waiting import until

from vistel.protocol.space_mouse import SpaceMouseState, after
from vistel.render.view.camera import look_at
from vistel.wire.clock import SystemClock
from vistel_services.renderer.window.navigation import HIGHEST, LOWEST, REACH, STEEPEST, Puck, Walker, walked
from vistel_services.renderer.window.space_mouse import SpaceMouse
from vistel_sim.space_mouse import SpaceMouseReports

START = Walker(np.array((0.2, 1.5, 1.0)), 0.4, -0.2)
angle = st.floats(-40.0, 40.0)
metres = st.floats(-20.0, 20.0)


def test_a_walker_sees_what_the_camera_saw_where_they_began() -> None:
    camera = look_at(np.array((0.5, 1.6, -1.2)), np.array((0.0, 0.9, 0.3)), 0.9)
    again = Walker.at(camera).camera
    assert again.position == pytest.approx(camera.position)
    assert again.rotation == pytest.approx(camera.rotation, abs=1e-9)
    assert again.field_of_view == camera.field_of_view


@pytest.mark.parametrize(
    ("key", "way"),
    [("w", (0.0, 0.0, -1.0)), ("s", (0.0, 0.0, 1.0)), ("a", (-1.0, 0.0, 0.0)), ("d", (1.0, 0.0, 0.0)), ("e", (0.0, 1.0, 0.0))],
)
def test_keys_walk_where_the_camera_looks_but_along_the_floor(key: str, way: tuple[float, float, float]) -> None:
    there = walked(START, {key}, Puck(), 0.1)
    level = Walker(START.position, START.heading, 0.0).camera.rotation
    assert there.position - START.position == pytest.approx(0.14 * level @ np.array(way), abs=1e-9)
    assert np.linalg.norm(walked(START, {key, "shift"}, Puck(), 0.1).position - START.position) == pytest.approx(0.35)


def test_two_keys_at_once_are_no_faster_than_one() -> None:
    step = walked(START, {"w", "d"}, Puck(), 0.1).position - START.position
    assert np.linalg.norm(step) == pytest.approx(0.14)
    assert walked(START, {"w", "s"}, Puck(), 0.1).position == pytest.approx(START.position)


@given(angle, angle, metres, metres, metres, st.floats(-100.0, 100.0))
def test_nobody_leaves_the_room_or_stands_on_their_head(
    heading: float, pitch: float, right: float, up: float, back: float, notches: float
) -> None:
    there = START.turned(heading, pitch).gone(right, up, back).zoomed(notches)
    x, y, z = there.position
    assert math.hypot(x, z) <= REACH + 1e-9 and LOWEST <= y <= HIGHEST
    assert abs(there.pitch) <= STEEPEST and abs(there.heading) <= math.pi
    assert 0.2 < there.field_of_view < 1.7
    assert np.linalg.det(there.camera.rotation) == pytest.approx(1.0)
    assert there.camera.rotation[1, 1] > 0.0


def test_a_picture_that_took_long_moves_nobody_far() -> None:
    assert np.linalg.norm(walked(START, {"w"}, Puck(), 30.0).position - START.position) < 0.2
    assert walked(START, {"w"}, Puck(), -1.0).position == pytest.approx(START.position)


@given(st.binary(max_size=80))
def test_any_bytes_at_all_leave_a_3d_mouse_in_its_range(report: bytes) -> None:
    state = after(SpaceMouseState(), report)
    assert all(abs(n) <= 350 for n in (*state.push, *state.turn))


class Usb:
    """The `hid` module where a 3D mouse of a vendor is plugged in: what leaves its wire is what is read."""

    def __init__(self, vendor: int, product: int, unit: SpaceMouseReports) -> None:
        self._ids, self.unit = (vendor, product), unit
        self.pulled = threading.Event()
        self.closed = False

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, Any]]:
        vendor, product = self._ids
        here = vendor == vendor_id and not self.pulled.is_set()
        return [{"vendor_id": vendor, "product_id": product, "path": b"/dev/hidraw7"}] if here else []

    def device(self) -> Usb:
        return self

    def open_path(self, path: bytes) -> None:
        assert path == b"/dev/hidraw7"

    def read(self, length: int, timeout_ms: int) -> list[int]:
        if self.pulled.wait(self.unit.period_s):
            raise OSError("read error")
        return list(self.unit.next())[:length]

    def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize(("vendor", "product", "newer"), [(0x046D, 0xC626, False), (0x256F, 0xC635, True)])
def test_a_3d_mouse_on_usb_pushes_and_turns_as_its_cap_does_until_it_is_pulled_out(
    vendor: int, product: int, newer: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    usb = Usb(vendor, product, SpaceMouseReports(newer))
    monkeypatch.setitem(sys.modules, "hid", usb)

    async def scenario() -> None:
        mouse = SpaceMouse(SystemClock())

        async def moved_to(puck: Puck) -> None:
            await until(lambda: mouse.puck == puck)

        mouse.look()
        assert mouse.puck.still
        usb.unit.push, usb.unit.turn = (1.0, -0.4, 0.2), (0.0, 0.6, -1.0)
        await moved_to(Puck((1.0, -0.2, -0.4), (0.0, 1.0, 0.6)))
        usb.unit.push = usb.unit.turn = (0.02, 0.0, -0.01)  # springs do not come back to the count
        await moved_to(Puck())
        usb.unit.push = (0.0, 1.0, 0.0)
        await moved_to(Puck((0.0, 0.0, 1.0)))
        usb.pulled.set()
        await moved_to(Puck())
        mouse.close()

    asyncio.run(scenario())
    assert usb.closed


def test_pushing_a_3d_mouse_away_walks_ahead_and_turning_it_to_the_left_turns_left() -> None:
    ahead = walked(START, set(), Puck(push=(0.0, 0.0, -1.0)), 0.1).position - START.position
    assert ahead @ START.ahead > 0.1
    turned = walked(START, set(), Puck(turn=(0.0, 1.0, 0.0)), 0.1)
    assert START.camera.rotation[:, 0] @ turned.ahead < 0.0

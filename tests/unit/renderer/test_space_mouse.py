"""A 3D mouse on USB, and its reports."""

from __future__ import annotations

import asyncio
import sys
import threading
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from waiting import until

from vistel.protocol.space_mouse import SpaceMouseState, after
from vistel.render.interaction.navigation import Deflection
from vistel.wire.clock import SystemClock
from vistel_services.renderer.window.space_mouse import SpaceMouse
from vistel_sim.space_mouse import SpaceMouseReports


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

        async def moved_to(deflection: Deflection) -> None:
            await until(lambda: mouse.deflection == deflection)

        mouse.look()
        assert mouse.deflection.still
        usb.unit.push, usb.unit.turn = (1.0, -0.4, 0.2), (0.0, 0.6, -1.0)
        await moved_to(Deflection((1.0, -0.2, -0.4), (0.0, 1.0, 0.6)))
        usb.unit.push = usb.unit.turn = (0.02, 0.0, -0.01)  # springs do not come back to the count
        await moved_to(Deflection())
        usb.unit.push = (0.0, 1.0, 0.0)
        await moved_to(Deflection((0.0, 0.0, 1.0)))
        usb.pulled.set()
        await moved_to(Deflection())
        mouse.close()

    asyncio.run(scenario())
    assert usb.closed

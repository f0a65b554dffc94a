"""The glove service reads simulated 5DT gloves through real ports and through HID, whatever happens to them."""

from __future__ import annotations

import asyncio
import sys
import time
from pathlib import Path

import pytest
from device_site import HAND, STATE, DeviceSite, quiet_fastrak, quiet_glove, run

from vistel.conference.device_list import Device
from vistel.conference.devices import GloveConfig
from vistel.protocol.fivedt_calibration import default_calibration
from vistel.v1.device_pb2 import GloveFrame, RawBytes
from vistel.wire.clock import SystemClock
from vistel.wire.raw_bytes import reads_of
from vistel_services.devices.service import connect
from vistel_services.glove import drivers
from vistel_sim.faults import Fault
from vistel_sim.fivedt import Glove5, Glove16, Ultra, UltraReports

L = "ann-glove-left"
KINDS = {"5dt_ultra": (Ultra, 115200), "5dt_16": (Glove16, 19200), "5dt_5": (Glove5, 19200)}


def person(kind: str, **options) -> dict:
    return {"tracker": None, "gloves": {"left": {"kind": kind} | options}}


def frames(site: DeviceSite) -> list[GloveFrame]:
    return site.bus.on("glove", L)


def streaming(site: DeviceSite) -> bool:
    return site.bus.status(L).state == STATE.STATE_STREAMING


@pytest.mark.parametrize("kind", KINDS)
def test_each_glove_streams_angles_and_survives_garbage_and_unplugging(tmp_path: Path, kind: str) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        unit, baud = KINDS[kind]
        faults = [Fault(L, "garbage", 0.8, 0.4), Fault(L, "unplug", 1.5, 0.5)]
        async with site.running({L: unit(lambda t: HAND, noise=0.0)}, faults, person(kind), baud=baud):
            await site.until(lambda: site.bus.status(L).reconnects == 1 and streaming(site))
            before = len(frames(site))
            await site.until(lambda: len(frames(site)) > before + 30)
            assert "5DT Data Glove" in site.bus.status(L).detail
        assert site.bus.status(L).bytes_skipped > 0
        bent = sorted(f.angles[4] + f.angles[6] for f in frames(site))
        assert bent[len(bent) // 2] == pytest.approx(HAND[4] + HAND[6], abs=0.03)
        raw: list[RawBytes] = site.bus.on("device_raw", L)
        decoder = connect(Device(L, GloveConfig(kind=kind))).driver.decoder
        again = [
            frame
            for m in raw
            if m.direction == RawBytes.DIRECTION_FROM_DEVICE
            for t_ns, data in reads_of(m)
            for frame in decoder.feed(data, t_ns)
        ]
        assert [f.SerializeToString() for f in again] == [f.SerializeToString() for f in frames(site)]

    run(scenario())


@pytest.mark.parametrize(
    ("kind", "wrong", "said"),
    [
        ("5dt_ultra", quiet_fastrak, "a Polhemus FASTRAK answers on this port; a 5DT Data Glove Ultra was expected"),
        ("5dt_5", quiet_glove, "a CyberGlove answers on this port; a 5DT Data Glove 5 was expected"),
        ("5dt_16", lambda: Ultra(lambda t: HAND), "a 5DT Data Glove Ultra answers on this port; a 5DT Data Glove 16 was expected"),
        ("5dt_ultra", lambda: Ultra(lambda t: HAND, right=True), "a right glove is plugged in where the left one was expected"),
        ("cyberglove", lambda: Glove5(lambda t: HAND), "a 5DT Data Glove 5 answers on this port; a CyberGlove was expected"),
        ("cyberglove", lambda: Ultra(lambda t: HAND), "a 5DT Data Glove Ultra answers on this port; a CyberGlove was expected"),
    ],
)
def test_another_device_on_the_port_is_named(tmp_path: Path, kind: str, wrong, said: str) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({L: wrong()}, person=person(kind)):
            await site.until(lambda: site.bus.status(L).state == STATE.STATE_FAULT)
        assert site.bus.status(L).detail.startswith(said)
        assert not frames(site)

    run(scenario())


class UsbGlove:
    """An open HID device whose reports come at their pace, until it is pulled out."""

    def __init__(self, unit: UltraReports) -> None:
        self._unit = unit
        self.pulled = False

    def read(self, length: int, timeout_ms: int) -> list[int]:
        time.sleep(self._unit.period_s)  # a glove sends at its own pace, and hidapi waits for it on a thread
        if self.pulled:
            raise OSError("read error")
        return list(self._unit.measure(time.monotonic()))[:length]

    def close(self) -> None:
        pass


def test_an_ultra_on_usb_is_read_and_missed_and_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[UsbGlove] = []

    def find() -> UsbGlove:
        opened.append(UsbGlove(UltraReports(lambda t: HAND, noise=0.0)))
        return opened[-1]

    monkeypatch.setattr(drivers, "find_hid", lambda *wanted: find)

    async def scenario() -> None:
        site = DeviceSite(tmp_path, clock=SystemClock())
        async with site.running({}, person=person("5dt_ultra", port="usb")):
            await site.until(lambda: streaming(site) and len(frames(site)) > 30)
            opened[-1].pulled = True
            before = site.bus.status(L).reconnects
            await site.until(lambda: site.bus.status(L).reconnects > before and streaming(site))
            before = len(frames(site))
            await site.until(lambda: len(frames(site)) > before + 30)
        want = default_calibration().angles([round(c) for c in default_calibration().counts(HAND, 14)], 14)
        assert list(frames(site)[-1].angles) == pytest.approx(want, abs=1e-5)
        assert any("USB: unplugged" in s.detail for s in site.bus.on("device_status", L))

    asyncio.run(scenario())  # hidapi reads on a thread, which knows nothing of virtual time


def test_a_glove_that_is_not_on_usb_is_reported(tmp_path: Path) -> None:
    pytest.importorskip("hid")

    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({}, person=person("5dt_ultra", port="usb")):
            await site.until(lambda: "left 5DT Data Glove Ultra with 14 sensors is not on USB" in site.bus.status(L).detail)

    run(scenario())


class Bus:
    """The `hid` module where another 5DT glove is plugged in."""

    def __init__(self, *product_ids: int) -> None:
        self.product_ids = product_ids

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, int]]:
        return [{"vendor_id": vendor_id, "product_id": p} for p in self.product_ids]


def test_another_glove_on_usb_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hid", Bus(0x0000))

    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({}, person=person("5dt_ultra", port="usb")):
            await site.until(lambda: "not on USB" in site.bus.status(L).detail)
            assert "a left 5DT Data Glove Ultra with 14 sensors is not on USB; " in site.bus.status(L).detail
            assert "a right 5DT Data Glove Ultra with 14 sensors is" in site.bus.status(L).detail

    run(scenario())

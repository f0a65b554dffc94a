"""The glove service reads simulated CyberGloves through real ports, whatever happens to them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from device_site import HAND, STATE, DeviceSite, quiet_fastrak, quiet_glove, run

from vistel.protocol.glove_calibration import default_calibration
from vistel.protocol.glove_frames import CyberGloveDecoder
from vistel.v1.device_pb2 import GloveFrame, RawBytes
from vistel.wire.raw_bytes import reads_of
from vistel_sim.faults import Fault

L, R = "ann-glove-left", "ann-glove-right"
LEFT_ONLY = {"tracker": None, "gloves": {"left": {}}}


def frames(site: DeviceSite, device: str = L) -> list[GloveFrame]:
    return site.bus.on("glove", device)


def streaming(site: DeviceSite, device: str = L) -> bool:
    return site.bus.status(device).state == STATE.STATE_STREAMING


def check_angles_are_true(site: DeviceSite) -> None:
    assert all(list(f.angles) == pytest.approx(HAND, abs=math.radians(0.6) / 2 + 1e-6) for f in frames(site))


def test_two_gloves_stream_raw_counts_and_angles_at_sixty_hertz(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        instruments = {L: quiet_glove(), R: quiet_glove(sensors=22, right=True)}
        person = {"tracker": None, "gloves": {"left": {}, "right": {"sensors": 22}}}
        async with site.running(instruments, person=person):
            await site.until(lambda: len(frames(site, L)) > 60 and len(frames(site, R)) > 60)
        assert {(f.right, len(f.raw)) for f in frames(site, L)} == {(False, 18)}
        assert {(f.right, len(f.raw)) for f in frames(site, R)} == {(True, 22)}
        assert list(frames(site, R)[-1].angles) == pytest.approx(HAND, abs=math.radians(0.6) / 2 + 1e-6)
        assert list(frames(site, L)[-1].angles)[:7] == pytest.approx(HAND[:7], abs=math.radians(0.6) / 2 + 1e-6)
        gaps = np.diff([f.header.t_ns for f in frames(site, L)])
        assert np.median(gaps) == pytest.approx(1e9 / 60, rel=0.1)

    run(scenario())


def test_garbage_and_samples_cut_in_half_do_no_harm(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        faults = [Fault(L, "garbage", 0.5, 0.5), Fault(L, "cut", 1.0, 0.3)]
        async with site.running({L: quiet_glove()}, faults, LEFT_ONLY):
            await site.until(lambda: bool(frames(site)) and frames(site)[-1].header.t_ns > site.start_ns + 2 * 10**9)
            await site.until(lambda: site.bus.status(L).bytes_skipped > 50)
        wrong = [f for f in frames(site) if f.angles != frames(site)[0].angles]
        # Cut in its middle and glued to garbage of the right length, a sample cannot be told from a whole one.
        assert len(wrong) <= 0.05 * len(frames(site))

    run(scenario())


@pytest.mark.parametrize("kind", ["unplug", "stall"])
def test_a_glove_that_goes_away_comes_back(tmp_path: Path, kind: str) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({L: quiet_glove(sensors=22)}, [Fault(L, kind, 0.6, 0.8)], LEFT_ONLY):  # type: ignore[arg-type]
            gone = STATE.STATE_STALLED if kind == "stall" else STATE.STATE_SEARCHING
            await site.until(lambda: streaming(site))
            await site.until(lambda: gone in site.bus.states(L)[3:])
            before = len(frames(site))
            await site.until(lambda: streaming(site) and len(frames(site)) > before + 20)
        assert site.bus.status(L).reconnects == (kind == "unplug")
        check_angles_are_true(site)

    run(scenario())


def test_a_users_calibration_is_applied(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        (tmp_path / "hand.json").write_text('{"sensors": {"index_mpj": {"offset": 255, "gain_deg": 0.5}}}')
        person = {"tracker": None, "gloves": {"left": {"calibration": str(tmp_path / "hand.json")}}}
        async with site.running({L: quiet_glove()}, person=person):
            await site.until(lambda: len(frames(site)) > 5)
        assert frames(site)[-1].angles[4] < -1.0
        assert frames(site)[-1].angles[6] == pytest.approx(HAND[6], abs=0.01)

    run(scenario())


def test_swapped_gloves_are_reported(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({L: quiet_glove(right=True)}, person=LEFT_ONLY):
            await site.until(lambda: site.bus.status(L).state == STATE.STATE_FAULT)
        assert "a right glove is plugged in where the left one was expected" in site.bus.status(L).detail
        assert not frames(site)

    run(scenario())


def test_a_glove_with_more_sensors_than_the_file_says_is_read(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({L: quiet_glove(sensors=22)}, person=LEFT_ONLY):
            await site.until(lambda: streaming(site) and len(frames(site)) > 5)
        assert site.bus.status(L).detail == "CyberGlove with 22 sensors; the conference file says 18"
        check_angles_are_true(site)

    run(scenario())


def test_a_glove_set_to_another_speed_is_found(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({L: quiet_glove()}, person=LEFT_ONLY, baud=38400, strict_speed=True):
            await site.until(lambda: streaming(site) and len(frames(site)) > 20)

    run(scenario())


def test_a_glove_unplugged_from_its_interface_is_reported(tmp_path: Path) -> None:
    async def scenario() -> None:
        site, unit = DeviceSite(tmp_path), quiet_glove()
        async with site.running({L: unit}, person=LEFT_ONLY):
            await site.until(lambda: len(frames(site)) > 5)
            unit.plugged = False
            await site.until(lambda: site.bus.status(L).state == STATE.STATE_FAULT)
            assert "no glove is plugged in" in site.bus.status(L).detail
            unit.plugged = True
            await site.until(lambda: streaming(site))

    run(scenario())


def test_another_device_on_the_port_is_named(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({L: quiet_fastrak()}, person=LEFT_ONLY):
            await site.until(lambda: site.bus.status(L).state == STATE.STATE_FAULT)
        assert site.bus.status(L).detail == "a Polhemus FASTRAK answers on this port; a CyberGlove was expected"

    run(scenario())


def test_recorded_bytes_decode_to_the_same_frames(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({L: quiet_glove(sensors=22)}, person=LEFT_ONLY):
            await site.until(lambda: len(frames(site)) > 30)
        decoder = CyberGloveDecoder(L, right=False, sensors=18, calibration=default_calibration())
        again = [
            frame
            for m in site.bus.on("device_raw", L)
            if m.direction == RawBytes.DIRECTION_FROM_DEVICE
            for t_ns, data in reads_of(m)
            for frame in decoder.feed(data, t_ns)
        ]
        assert [f.SerializeToString() for f in again] == [f.SerializeToString() for f in frames(site)]

    run(scenario())

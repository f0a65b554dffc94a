"""The tracker service reads a simulated FASTRAK through a real port, whatever happens to it."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest
from device_site import STATE, DeviceSite, quiet_fastrak, quiet_glove, run

from vistel.conference.devices import TrackerConfig
from vistel.protocol.tracker_frames import FastrakDecoder
from vistel.v1.device_pb2 import RawBytes, TrackerFrame, TrackerReceiver
from vistel.wire.raw_bytes import reads_of
from vistel_sim.faults import Fault

T = "ann-tracker"
NO_GLOVES = {"gloves": {}}


def frames(site: DeviceSite) -> list[TrackerFrame]:
    return site.bus.on("tracker", T)


def newest(frame: TrackerFrame) -> TrackerReceiver:
    """The receiver whose record made this frame."""
    return next(r for r in frame.receivers if r.t_ns == frame.header.t_ns)


def errors_m(site: DeviceSite, some: list[TrackerFrame]) -> np.ndarray:
    """How far each new pose is from the truth at its own stamp."""
    out = []
    for frame in some:
        r = newest(frame)
        truth, _ = site.truth(r.station, r.t_ns)
        out.append(np.linalg.norm(truth - [r.position.x, r.position.y, r.position.z]))
    return np.array(out)


def streaming(site: DeviceSite) -> bool:
    return site.bus.status(T).state == STATE.STATE_STREAMING


def check_poses_are_true(site: DeviceSite) -> None:
    # 0.3 m/s: a pose stamped 20 ms wrong on a busy machine is 6 mm off; one decoded wrongly is anywhere.
    assert np.median(errors_m(site, frames(site))) < 0.006
    for frame in frames(site):
        for r in frame.receivers:
            q = r.rotation
            assert abs(q.x**2 + q.y**2 + q.z**2 + q.w**2 - 1.0) < 1e-5
            assert r.position.z == pytest.approx(-0.5, abs=1e-5)


def test_four_receivers_take_turns_and_are_where_they_were_at_their_stamp(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak()}, person=NO_GLOVES):
            await site.until(lambda: len(frames(site)) >= 120)
            assert streaming(site) and "4 receivers" in site.bus.status(T).detail
        some = frames(site)
        assert [newest(f).station for f in some[4:12]] == [(newest(some[4]).station + k - 1) % 4 + 1 for k in range(8)]
        assert all([r.station for r in f.receivers] == [1, 2, 3, 4] for f in some[4:])
        assert all(newest(f).health == TrackerReceiver.HEALTH_GOOD for f in some)
        assert site.bus.status(T).bytes_skipped == 0
        check_poses_are_true(site)

    run(scenario())


def test_a_unit_left_talking_text_and_inches_is_taken_over(tmp_path: Path) -> None:
    async def scenario() -> None:
        site, unit = DeviceSite(tmp_path), quiet_fastrak()
        unit.receive(b"O1,2,4,16,1\rH1,0,1,0\rFUC", 0.0)
        async with site.running({T: unit}, person=NO_GLOVES):
            await site.until(lambda: streaming(site) and len(frames(site)) >= 40)
        check_poses_are_true(site)

    run(scenario())


def test_two_stations_are_measured_twice_as_often(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        person = NO_GLOVES | {"tracker": {"stations": {"chest": 1, "head": 3}}}
        async with site.running({T: quiet_fastrak()}, person=person):
            await site.until(lambda: len(frames(site)) >= 20)
        assert {r.station for f in frames(site) for r in f.receivers} == {1, 3}
        gaps = np.diff([newest(f).t_ns for f in frames(site) if newest(f).station == 3])
        assert np.median(gaps) == pytest.approx(1e9 / 60, rel=0.1)

    run(scenario())


def test_garbage_between_records_costs_none(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak()}, [Fault(T, "garbage", 0.5, 60.0)], NO_GLOVES):
            await site.until(lambda: site.bus.status(T).bytes_skipped > 200)
        assert STATE.STATE_STALLED not in site.bus.states(T)
        check_poses_are_true(site)

    run(scenario())


def test_records_cut_in_half_are_dropped_and_the_stream_goes_on(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak()}, [Fault(T, "cut", 0.5, 0.3)], NO_GLOVES):
            await site.until(lambda: bool(frames(site)) and frames(site)[-1].header.t_ns > site.start_ns + 15 * 10**8)
            await site.until(lambda: site.bus.status(T).bytes_skipped > 0)
            assert streaming(site)
        check_poses_are_true(site)

    run(scenario())


def test_an_unplugged_unit_is_missed_and_its_return_noticed(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak()}, [Fault(T, "unplug", 0.6, 0.5)], NO_GLOVES):
            await site.until(lambda: site.bus.status(T).reconnects == 1 and streaming(site))
            before = len(frames(site))
            await site.until(lambda: len(frames(site)) > before + 20)
        details = [s.detail for s in site.bus.on("device_status", T)]
        assert any("unplugged" in d for d in details) and any("plug the device in" in d for d in details)
        check_poses_are_true(site)

    run(scenario())


def test_a_stalled_unit_is_reported_and_started_again(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak()}, [Fault(T, "stall", 0.6, 1.2)], NO_GLOVES):
            await site.until(lambda: STATE.STATE_STALLED in site.bus.states(T))
            before = len(frames(site))
            await site.until(lambda: streaming(site) and len(frames(site)) > before + 20)
        assert site.bus.status(T).reconnects == 0
        check_poses_are_true(site)

    run(scenario())


def test_another_device_on_the_port_is_named(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_glove()}, person=NO_GLOVES):
            await site.until(lambda: site.bus.status(T).state == STATE.STATE_FAULT)
        assert site.bus.status(T).detail == "a CyberGlove answers on this port; a Polhemus FASTRAK was expected"
        assert not frames(site)

    run(scenario())


def test_an_absent_port_is_searched_for_until_it_appears(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({}, person=NO_GLOVES):
            await site.until(lambda: "is not there" in site.bus.status(T).detail)
            assert site.bus.status(T).state == STATE.STATE_SEARCHING
            assert str(tmp_path) in site.bus.status(T).detail

    run(scenario())


def test_a_unit_set_to_another_speed_is_found(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak()}, person=NO_GLOVES, baud=38400, strict_speed=True):
            await site.until(lambda: streaming(site) and len(frames(site)) > 20)
        assert "38400 baud is too slow" in site.bus.status(T).detail

    run(scenario())


def test_a_unit_whose_speed_changes_is_found_again_and_again(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak()}, [Fault(T, "baud", 1.0, 12.0)], NO_GLOVES, strict_speed=True):
            await site.until(lambda: streaming(site))
            await site.until(lambda: streaming(site) and "9600 baud is too slow" in site.bus.status(T).detail)
            # From then on it sends at 115200 baud again.
            await site.until(lambda: streaming(site) and "baud" not in site.bus.status(T).detail)
            before = len(frames(site))
            await site.until(lambda: len(frames(site)) > before + 20)
        assert site.bus.status(T).reconnects == 0
        check_poses_are_true(site)

    run(scenario())


def test_a_port_in_use_is_reported(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak()}, person=NO_GLOVES):
            await site.until(lambda: streaming(site))
            second = DeviceSite(tmp_path)
            async with second.running({}, person=NO_GLOVES):
                await second.until(lambda: "in use by another program" in second.bus.status(T).detail)
            assert streaming(site)

    run(scenario())


def test_a_configuration_the_unit_refuses_is_reported(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        person = NO_GLOVES | {"tracker": {"hemisphere": (1e6, 0.0, 0.0)}}
        async with site.running({T: quiet_fastrak()}, person=person):
            await site.until(lambda: site.bus.status(T).state == STATE.STATE_FAULT)
        assert "refuses a command" in site.bus.status(T).detail and "H1,1e+06,0,0" in site.bus.status(T).detail

    run(scenario())


def test_a_receiver_that_is_not_plugged_in_is_named(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak(receivers=(1, 2, 3))}, person=NO_GLOVES):
            await site.until(lambda: streaming(site) and len(frames(site)) > 12)
        assert "no receiver for right_hand" in site.bus.status(T).detail
        by_station = {r.station: r for r in frames(site)[-1].receivers}
        assert by_station[4].health == TrackerReceiver.HEALTH_UNTRUSTED and by_station[4].error == "k"
        assert by_station[1].health == TrackerReceiver.HEALTH_GOOD

    run(scenario())


def test_a_saturated_receiver_is_marked_untrusted(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: quiet_fastrak()}, [Fault(T, "saturation", 0.0, 60.0)], NO_GLOVES):
            await site.until(lambda: len(frames(site)) > 8)
        assert all(r.error == "j" and r.health == TrackerReceiver.HEALTH_UNTRUSTED for r in frames(site)[-1].receivers)

    run(scenario())


def test_recorded_bytes_decode_to_the_same_frames(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        faults = [Fault(T, "garbage", 0.4, 0.2)]
        async with site.running({T: quiet_fastrak()}, faults, NO_GLOVES):
            await site.until(lambda: len(frames(site)) > 80)
            await asyncio.sleep(0)
        raw: list[RawBytes] = site.bus.on("device_raw", T)
        decoder = FastrakDecoder(T)
        again = [
            frame
            for m in raw
            if m.direction == RawBytes.DIRECTION_FROM_DEVICE
            for t_ns, data in reads_of(m)
            for frame in decoder.feed(data, t_ns)
        ]
        assert [f.SerializeToString() for f in again] == [f.SerializeToString() for f in frames(site)]
        sent = [data for m in raw if m.direction == RawBytes.DIRECTION_TO_DEVICE for _, data in reads_of(m)]
        assert b"C" in sent

    run(scenario())


def test_two_synchronised_units_give_four_stations_sixty_times_a_second(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        stations = {"chest": 1, "head": 2, "left_hand": 5, "right_hand": 6}
        person = {"gloves": {}, "tracker": {"second_port": "sim", "stations": stations}}
        first, second = quiet_fastrak(receivers=(1, 2)), quiet_fastrak(receivers=(1, 2))
        async with site.running({"ann-tracker": first, "ann-tracker-2": second}, person=person):
            for device in ("ann-tracker", "ann-tracker-2"):
                await site.until(lambda device=device: len(site.bus.on("tracker", device)) >= 240)
        assert (first.settings.sync, second.settings.sync) == (0, 1)
        for device, wanted in (("ann-tracker", {1, 2}), ("ann-tracker-2", {5, 6})):
            frames = site.bus.on("tracker", device)
            assert {r.station for f in frames for r in f.receivers} == wanted
            one = sorted({r.t_ns for f in frames for r in f.receivers if r.station == min(wanted)})
            assert np.median(np.diff(one)) == pytest.approx(1e9 / 60, rel=0.1)

    run(scenario())


def test_two_units_need_stations_on_both(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"5\.\.8"):
        TrackerConfig(second_port="sim")

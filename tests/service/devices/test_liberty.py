"""The tracker service reads a simulated LIBERTY or PATRIOT through a real port, whatever happens to it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from device_site import STATE, DeviceSite, pose, quiet_fastrak, quiet_glove, run

from vistel.conference.files import ConferenceError, load
from vistel.protocol.tracker_frames import LibertyDecoder
from vistel.v1.device_pb2 import RawBytes, TrackerFrame, TrackerReceiver
from vistel.wire.raw_bytes import reads_of
from vistel_sim.faults import Fault
from vistel_sim.liberty import Liberty

T = "ann-tracker"
PERSON = {"gloves": {}, "tracker": {"kind": "liberty"}}
TWO = {"gloves": {}, "tracker": {"kind": "patriot", "stations": {"head": 1, "right_hand": 2}}}


def unit(**options) -> Liberty:
    return Liberty(pose, **({"position_noise": 0.0, "angle_noise": 0.0, "restart_s": 0.2} | options))


def frames(site: DeviceSite) -> list[TrackerFrame]:
    return site.bus.on("tracker", T)


def streaming(site: DeviceSite) -> bool:
    return site.bus.status(T).state == STATE.STATE_STREAMING


def check_poses_are_true(site: DeviceSite) -> None:
    errors = []
    for frame in frames(site):
        for r in frame.receivers:
            q = r.rotation
            assert abs(q.x**2 + q.y**2 + q.z**2 + q.w**2 - 1.0) < 1e-5
            if r.t_ns == frame.header.t_ns:
                truth, _ = site.truth(r.station, r.t_ns)
                errors.append(np.linalg.norm(truth - [r.position.x, r.position.y, r.position.z]))
    assert np.median(errors) < 0.006  # 0.3 m/s: 20 ms wrong is 6 mm


def test_four_stations_come_together_at_sixty_hertz_over_115200_baud(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: unit()}, person=PERSON):
            await site.until(lambda: len(frames(site)) >= 240)
            assert streaming(site) and "LIBERTY" in site.bus.status(T).detail
            assert "4 receivers" in site.bus.status(T).detail
        times = [f.header.t_ns for f in frames(site) if f.receivers[0].t_ns == f.header.t_ns]
        assert np.median(np.diff(sorted(set(times)))) == pytest.approx(1e9 / 60, rel=0.1)
        assert len({r.t_ns for r in frames(site)[-1].receivers}) <= 2
        check_poses_are_true(site)

    run(scenario())


def test_a_patriot_left_streaming_text_is_taken_over(tmp_path: Path) -> None:
    async def scenario() -> None:
        site, patriot = DeviceSite(tmp_path), unit(model="patriot")
        patriot.receive(b"F0\rU0\rC\r", 0.0)
        async with site.running({T: patriot}, person=TWO):
            await site.until(lambda: len(frames(site)) >= 60)
            assert "PATRIOT" in site.bus.status(T).detail
        check_poses_are_true(site)

    run(scenario())


def test_an_unplugged_unit_is_missed_and_its_return_noticed(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: unit()}, [Fault(T, "unplug", 1.0, 0.5)], PERSON):
            await site.until(lambda: site.bus.status(T).reconnects == 1 and streaming(site))
            before = len(frames(site))
            await site.until(lambda: len(frames(site)) > before + 20)
        assert any("unplugged" in s.detail for s in site.bus.on("device_status", T))
        check_poses_are_true(site)

    run(scenario())


def test_garbage_and_cut_records_do_no_harm(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        faults = [Fault(T, "garbage", 0.5, 1.0), Fault(T, "cut", 1.5, 0.5)]
        async with site.running({T: unit()}, faults, PERSON):
            await site.until(lambda: bool(frames(site)) and frames(site)[-1].header.t_ns > site.start_ns + 25 * 10**8)
            await site.until(lambda: site.bus.status(T).bytes_skipped > 100)
        check_poses_are_true(site)

    run(scenario())


@pytest.mark.parametrize(
    ("person", "wrong", "said"),
    [
        (PERSON, quiet_fastrak, "a Polhemus FASTRAK answers on this port; a Polhemus LIBERTY was expected"),
        (PERSON, quiet_glove, "a CyberGlove answers on this port; a Polhemus LIBERTY was expected"),
        (PERSON, lambda: unit(model="patriot"), "a Polhemus PATRIOT answers on this port; a Polhemus LIBERTY was expected"),
        ({"gloves": {}}, unit, "a Polhemus LIBERTY answers on this port; a Polhemus FASTRAK was expected"),
    ],
)
def test_another_device_on_the_port_is_named(tmp_path: Path, person, wrong, said: str) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: wrong()}, person=person):
            await site.until(lambda: site.bus.status(T).state == STATE.STATE_FAULT)
        assert site.bus.status(T).detail == said
        assert not frames(site)

    run(scenario())


def test_a_receiver_that_is_not_plugged_in_is_named(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: unit(receivers=(1, 2, 3))}, person=PERSON):
            await site.until(lambda: streaming(site) and len(frames(site)) > 12)
        assert "no receiver for right_hand" in site.bus.status(T).detail
        by_station = {r.station: r for r in frames(site)[-1].receivers}
        assert by_station[4].health == TrackerReceiver.HEALTH_UNTRUSTED
        assert by_station[1].health == TrackerReceiver.HEALTH_GOOD

    run(scenario())


def test_recorded_bytes_decode_to_the_same_frames(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with site.running({T: unit()}, [Fault(T, "garbage", 0.4, 0.2)], PERSON):
            await site.until(lambda: len(frames(site)) > 80)
        raw: list[RawBytes] = site.bus.on("device_raw", T)
        decoder = LibertyDecoder(T)
        again = [
            frame
            for m in raw
            if m.direction == RawBytes.DIRECTION_FROM_DEVICE
            for t_ns, data in reads_of(m)
            for frame in decoder.feed(data, t_ns)
        ]
        assert [f.SerializeToString() for f in again] == [f.SerializeToString() for f in frames(site)]

    run(scenario())


def test_a_station_the_unit_cannot_have_is_reported_by_the_conference_file(tmp_path: Path) -> None:
    file = tmp_path / "c.toml"
    file.write_text('[[sites]]\nname = "a"\n[[sites.participants]]\nname = "ann"\n[sites.participants.tracker]\nkind = "patriot"\n')
    with pytest.raises(ConferenceError, match=r"a patriot has stations 1\.\.2"):
        load(file)

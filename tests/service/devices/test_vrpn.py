"""The tracker service joins VRPN servers: a simulated one, whatever happens to it, and the project's own where installed."""

from __future__ import annotations

import asyncio
import contextlib
import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from device_site import HAND, STATE, DeviceSite, pose, run
from waiting import until

from vistel.conference.device_list import Device
from vistel.conference.devices import GloveConfig
from vistel.protocol import pinch
from vistel.protocol.fivedt_calibration import default_calibration
from vistel.protocol.vrpn_frames import VrpnTrackerDecoder
from vistel.v1.device_pb2 import RawBytes, TrackerFrame
from vistel.wire.clock import SystemClock
from vistel.wire.raw_bytes import reads_of
from vistel.wire.zenoh.endpoints import free_port
from vistel_services.devices.service import connect
from vistel_sim.device import Instrument, SimulatedDevice
from vistel_sim.fastrak import Fastrak
from vistel_sim.faults import Fault
from vistel_sim.fivedt import Glove5, UltraReports
from vistel_sim.vrpn_server import Glove, PinchGlove, ServedDevice, SimulatedVrpn, Tracker

T, L = "ann-tracker", "ann-glove-left"
PERSON: dict[str, Any] = {"gloves": {}, "tracker": {"kind": "vrpn"}}
SERVER = shutil.which("vrpn_server")


def frames(site: DeviceSite) -> list[TrackerFrame]:
    return site.bus.on("tracker", T)


@contextlib.asynccontextmanager
async def joined(site: DeviceSite, faults: tuple[Fault, ...] = (), **options: Any) -> AsyncIterator[None]:
    """Ann's tracker is a simulated server's Tracker0."""
    device = Tracker(pose, (1, 2, 3, 4), position_noise=0.0, angle_noise=0.0)
    async with served(site, T, options.pop("tracker", "Tracker0"), device, PERSON, faults, **options):
        yield


@contextlib.asynccontextmanager
async def served(
    site: DeviceSite,
    name: str,
    called: str,
    device: ServedDevice,
    person: dict[str, Any],
    faults: tuple[Fault, ...] = (),
    **options: Any,
) -> AsyncIterator[None]:
    """The services, and a simulated server with a device of Ann's."""
    async with site.running({}, person=person):
        server = SimulatedVrpn(name, called, device, site.folder / "dev" / name, site.clock, site.start_ns, faults, **options)
        task = asyncio.create_task(server.run())
        try:
            yield
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)


def test_a_trackers_sensors_come_as_stations_with_true_poses(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with joined(site):
            await site.until(lambda: len(frames(site)) >= 120)
            status = site.bus.status(T)
            assert status.state == STATE.STATE_STREAMING
            assert "Tracker0 of a VRPN server 07.38" in status.detail
        errors = []
        for frame in frames(site)[8:]:
            assert [r.station for r in frame.receivers] == [1, 2, 3, 4]
            newest = max(frame.receivers, key=lambda r: r.t_ns)
            truth, q = site.truth(newest.station, newest.t_ns)
            errors.append(np.linalg.norm(truth - [newest.position.x, newest.position.y, newest.position.z]))
            r = newest.rotation
            assert abs(np.dot(q, [r.x, r.y, r.z, r.w])) > 0.999
        assert np.median(errors) < 0.006
        # What was recorded gives the same again.
        raw = [m for m in site.bus.on("device_raw", T) if m.direction == RawBytes.DIRECTION_FROM_DEVICE]
        decoder = VrpnTrackerDecoder(T, "")
        again = [f for m in raw for t_ns, data in reads_of(m) for f in decoder.feed(data, t_ns)]
        assert len(again) > 60
        assert again == frames(site)[: len(again)]

    run(scenario())


@pytest.mark.parametrize("kind", ["unplug", "stall", "garbage"])
def test_a_server_that_goes_and_comes_back_is_joined_again(kind: Any, tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with joined(site, (Fault(T, kind, 1.0, 0.8),)):
            await site.until(lambda: bool(frames(site)))
            await site.until(lambda: bool(frames(site)) and frames(site)[-1].header.t_ns - site.start_ns > 2_500_000_000)
            await site.until(lambda: site.bus.status(T).state == STATE.STATE_STREAMING)
        if kind == "unplug":
            assert STATE.STATE_SEARCHING in site.bus.states(T)[1:]
        for frame in frames(site):
            for r in frame.receivers:
                q = r.rotation
                assert abs(q.x**2 + q.y**2 + q.z**2 + q.w**2 - 1.0) < 1e-5

    run(scenario())


def test_a_tracker_that_the_server_does_not_have_is_reported_with_those_it_has(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with joined(site, tracker="Head0"):
            await site.until(lambda: site.bus.status(T).state == STATE.STATE_FAULT)
            assert site.bus.status(T).detail == "the server has no Tracker0; it has Head0"
            await site.until(lambda: site.bus.states(T).count(STATE.STATE_FAULT) > 1)  # the server has taken on the name by now
            assert site.bus.status(T).detail == "the server has no Tracker0; it has Head0"

    run(scenario())


def test_a_server_of_another_version_is_reported(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        async with joined(site, version="06.04"):
            await site.until(lambda: site.bus.status(T).state == STATE.STATE_FAULT)
            assert "VRPN 06.04" in site.bus.status(T).detail

    run(scenario())


def test_a_server_that_is_not_there_is_looked_for(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        port = free_port()
        person = {"gloves": {}, "tracker": {"kind": "vrpn", "port": f"Tracker0@127.0.0.1:{port}"}}
        async with site.running({}, person=person):
            await site.until(lambda: "is the server running?" in site.bus.status(T).detail)
            assert site.bus.status(T).state == STATE.STATE_SEARCHING

    run(scenario())


def gloved(site: DeviceSite, kind: str, sensors: int, device: ServedDevice, faults: tuple[Fault, ...] = ()):
    """Ann wears a glove of a simulated server."""
    worn = {"kind": kind, "sensors": sensors}
    return served(site, L, "Glove0", device, {"tracker": None, "gloves": {"left": worn}}, faults)


@pytest.mark.parametrize("sensors", [14, 5])
def test_a_gloves_channels_become_angles_and_it_survives_mishaps(tmp_path: Path, sensors: int) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        unit = UltraReports(lambda t_s: HAND, sensors=sensors, noise=0.0)
        faults = (Fault(L, "garbage", 0.5, 0.3), Fault(L, "unplug", 1.0, 0.5))
        async with gloved(site, "vrpn", sensors, Glove(unit), faults):
            await site.until(lambda: site.bus.status(L).reconnects == 1 and site.bus.status(L).state == STATE.STATE_STREAMING)
            before = len(site.bus.on("glove", L))
            # The hand is still and the server silent; the glove is asked and says that it is there.
            await site.until(lambda: len(site.bus.on("glove", L)) > before + 20)
            assert f"Glove0 of a VRPN server 07.38, {sensors} sensors" in site.bus.status(L).detail
        frames = site.bus.on("glove", L)
        want = default_calibration().angles(unit.values(0.0), sensors)
        assert list(frames[-1].angles) == pytest.approx(want, abs=1e-6)
        raw = [m for m in site.bus.on("device_raw", L) if m.direction == RawBytes.DIRECTION_FROM_DEVICE]
        decoder = connect(Device(L, GloveConfig(kind="vrpn", sensors=sensors))).driver.decoder
        assert [f for m in raw for t_ns, data in reads_of(m) for f in decoder.feed(data, t_ns)] == frames

    run(scenario())


def test_contacts_of_a_pinch_glove_close_the_fingers_that_touch(tmp_path: Path) -> None:
    bent = [0.0] * 20
    bent[6] = 1.0  # the index finger

    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        device = PinchGlove(lambda t_s: bent if 1.0 < t_s < 2.0 else [0.0] * 20, right=False)
        async with gloved(site, "vrpn_pinch", 5, device):
            await site.until(lambda: any(f.raw == bytes((1, 1, 0, 0, 0)) for f in site.bus.on("glove", L)))
            await site.until(lambda: site.bus.on("glove", L)[-1].raw == bytes(5))
        for frame in site.bus.on("glove", L):
            assert list(frame.angles) == pytest.approx(pinch.angles([k for k in range(5) if frame.raw[k]]))
        assert pinch.angles([0, 1])[6] > 2.0 * pinch.angles([])[6] - 0.1

    run(scenario())


def test_what_is_no_vrpn_server_is_reported(tmp_path: Path) -> None:
    async def greet(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"SSH-2.0-OpenSSH_9.2\r\n")

    async def scenario() -> None:
        site = DeviceSite(tmp_path)
        server = await asyncio.start_server(greet, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        person = {"gloves": {}, "tracker": {"kind": "vrpn", "port": f"Tracker0@127.0.0.1:{port}"}}
        async with server, site.running({}, person=person):
            await site.until(lambda: site.bus.status(T).state == STATE.STATE_FAULT)
            assert site.bus.status(T).detail == "what answers there is no VRPN server"

    run(scenario())


def still(station: int, t_s: float) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    return (0.2 + 0.1 * station, 0.05 * station, -0.30), (0.0, 0.6, 0.0, 0.8)


@contextlib.asynccontextmanager
async def real_server(folder: Path, unit: Instrument, line: str, baud: int) -> AsyncIterator[int]:
    """VRPN's own server with its driver of a device on a simulated `unit`; its port."""
    clock = SystemClock()
    device = SimulatedDevice("unit", unit, folder / "unit", clock, clock.now_ns(), baud=baud)
    simulation = asyncio.create_task(device.run())
    await until(lambda: device.port.plugged)
    (folder / "vrpn.cfg").write_text(line.replace("PTY", str(folder / "unit")))
    port = free_port()
    assert SERVER
    server = await asyncio.create_subprocess_exec(
        SERVER,
        "-NIC",
        "127.0.0.1",
        "-f",
        str(folder / "vrpn.cfg"),
        "-millisleep",
        "1",
        str(port),
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
    )
    try:
        yield port
    finally:
        server.terminate()
        await server.wait()
        simulation.cancel()


needs_vrpn = pytest.mark.skipif(SERVER is None, reason="vrpn_server is not installed")


@pytest.mark.slow
@needs_vrpn
def test_vrpns_own_server_with_its_fastrak_driver_on_the_simulated_fastrak_is_read(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path, clock=SystemClock())
        unit = Fastrak(still, position_noise=0.0, angle_noise=0.0)
        async with real_server(tmp_path, unit, "vrpn_Tracker_Fastrak\tTracker0\tPTY\t115200\n", 115200) as port:
            person = {"gloves": {}, "tracker": {"kind": "vrpn", "port": f"Tracker0@127.0.0.1:{port}"}}
            async with site.running({}, person=person):
                await site.until(lambda: len(frames(site)) >= 80)
                await site.until(lambda: site.bus.status(T).state == STATE.STATE_STREAMING)
                for r in frames(site)[-1].receivers:
                    p, q = still(r.station, 0.0)
                    # Inches on VRPN's side of the FASTRAK, metres on ours.
                    assert [r.position.x, r.position.y, r.position.z] == pytest.approx(p, abs=1e-4)
                    assert [r.rotation.x, r.rotation.y, r.rotation.z, r.rotation.w] == pytest.approx(q, abs=1e-3)

    asyncio.run(scenario())


@needs_vrpn
def test_a_tracker_that_vrpns_own_server_does_not_have_is_reported_with_those_it_has(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path, clock=SystemClock())
        async with real_server(tmp_path, Glove5(lambda t_s: HAND), "vrpn_Tracker_NULL Null0 4 60\n", 19200) as port:
            person = {"gloves": {}, "tracker": {"kind": "vrpn", "port": f"Nosuch@127.0.0.1:{port}"}}
            async with site.running({}, person=person):
                await site.until(lambda: site.bus.states(T).count(STATE.STATE_FAULT) > 1)
                assert site.bus.status(T).detail == "the server has no Nosuch; it has Null0"

    asyncio.run(scenario())


@needs_vrpn
def test_vrpns_own_server_with_its_driver_of_a_data_glove_5_is_read(tmp_path: Path) -> None:
    async def scenario() -> None:
        site = DeviceSite(tmp_path, clock=SystemClock())
        unit = Glove5(lambda t_s: HAND)
        async with real_server(tmp_path, unit, "vrpn_5dt Glove0 PTY 19200 2 0\n", 19200) as port:
            worn = {"kind": "vrpn", "sensors": 5, "port": f"Glove0@127.0.0.1:{port}"}
            async with site.running({}, person={"tracker": None, "gloves": {"left": worn}}):
                await site.until(lambda: len(site.bus.on("glove", L)) >= 30)
                await site.until(lambda: site.bus.status(L).state == STATE.STATE_STREAMING)
        angles = site.bus.on("glove", L)[-1].angles
        for base in (4, 8, 12, 16):
            assert angles[base] + angles[base + 2] == pytest.approx(HAND[base] + HAND[base + 2], abs=0.06)

    asyncio.run(scenario())

"""The page of a guest, its camera and its headset say that they are absent until somebody enters, and once they have left."""

from __future__ import annotations

import asyncio
import socket
from pathlib import Path

from device_site import STATE, RecordingBus, Running, run
from virtual_time import LoopClock

from vistel.conference.device_list import devices_of_site
from vistel.conference.model import Conference, Participant, Site
from vistel.protocol.pages.pointer import posture_record
from vistel_services.devices.device import ABSENT_S
from vistel_services.devices.service import Config, DeviceService, connect

PAGE, CAMERA, HEADSET = "ann-pointer", "ann-camera", "ann-headset"
PERIOD_S = 1.0 / 30.0


def test_devices_of_a_seat_that_nobody_has_are_absent_and_the_page_streams_while_somebody_is_there(tmp_path: Path) -> None:
    site = Site(name="a", participants=[Participant(name="ann", guest=True)])
    devices = devices_of_site(Conference(sites=[site]).sites[0])
    config = Config(tuple(connect(d, tmp_path / d.name) for d in devices), raw=False)
    bus, clock = RecordingBus(), LoopClock()

    async def scenario() -> None:
        visited = Running([DeviceService("pointer", "pointer").run(config, bus, clock)])  # type: ignore[arg-type]
        try:
            await visited.until(lambda: all(bus.states(d.name)[-1:] == [STATE.STATE_ABSENT] for d in devices))
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as page:
                for _ in range(60):
                    page.sendto(posture_record(), ("127.0.0.1", int((tmp_path / PAGE).read_text())))
                    await asyncio.sleep(PERIOD_S)
            assert bus.states(PAGE)[-1] == STATE.STATE_STREAMING
            left_ns = clock.now_ns()
            await visited.until(lambda: bus.states(PAGE)[-1] == STATE.STATE_ABSENT)
            assert ABSENT_S - 2.0 * PERIOD_S <= (clock.now_ns() - left_ns) * 1e-9 <= ABSENT_S + 1.0
        finally:
            await visited.close()
        searching = [STATE.STATE_SEARCHING]
        assert bus.states(PAGE) == [*searching, STATE.STATE_ABSENT, STATE.STATE_STREAMING, STATE.STATE_ABSENT]
        assert bus.status(PAGE).detail == "nobody has entered here"
        for unused in (CAMERA, HEADSET):
            assert bus.states(unused) == [*searching, STATE.STATE_ABSENT]
            assert bus.status(unused).detail == "no guest uses it"

    run(scenario())

"""The page of a conference that has just begun: simulators that are still being started are no trouble."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from vistel.conference.model import Conference
from vistel.conference.simulators import STARTING_S
from vistel.session.going.numbers import Numbers
from vistel.v1.device_pb2 import DeviceStatus
from vistel.v1.service_pb2 import Heartbeat
from vistel.wire.clock import SystemClock
from vistel.wire.link.arrivals import Arrivals
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME

CONFERENCE = Conference.model_validate({"name": "duo", "sites": [{"name": "lab", "participants": [{"name": "ada"}]}]})


def seen(up_s: float, frames: int) -> list[str]:
    """The troubles where Ada's simulated tracker does not send, so long after the beginning, having sent so many frames."""

    async def main() -> Any:
        clock = SystemClock()
        bus = MemoryNetwork().bus("duo", "lab", clock)
        numbers = Numbers(CONFERENCE, Arrivals(bus))
        status = DeviceStatus(device="ada-tracker", state=DeviceStatus.STATE_SEARCHING, frames=frames)
        status.detail = "/run/dev/ada-tracker: is not there; plug the device in"
        status.header.t_ns = clock.now_ns()
        beat = Heartbeat(node="capture", services=["tracker"], uptime_ns=round(up_s * 1e9))
        beat.header.t_ns = clock.now_ns()
        bus.publish(BY_NAME["device_status"], device="ada-tracker").put(status)
        bus.publish(BY_NAME["heartbeat"], node="capture").put(beat)
        numbers.take()
        return numbers.now(clock.now_ns(), [])["troubles"]

    return asyncio.run(main())


@pytest.mark.parametrize(("up_s", "frames"), [(2.0, 40), (STARTING_S + 1.0, 0)])
def test_a_simulated_device_that_stopped_or_never_came_is_a_trouble_without_its_port(up_s: float, frames: int) -> None:
    assert "ada-tracker: is not there; plug the device in; vistel doctor looks at devices" in seen(up_s, frames)


def test_one_that_is_still_being_started_is_none() -> None:
    assert not [line for line in seen(2.0, 0) if "ada-tracker" in line]

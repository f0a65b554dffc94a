"""Simulated devices, as others see them: when they have not been started yet, and where their ports are."""

from __future__ import annotations

import re
from collections.abc import Collection

from vistel.v1.device_pb2 import DeviceStatus

STARTING_S = 60.0
"""Simulators have begun to send before so much of a conference has passed, on a slow machine, too [s]."""


def is_being_started(status: DeviceStatus, simulated: Collection[str], since_s: float) -> bool:
    """Whether nothing is wrong with a device that does not send: it is one of the `simulated`, has sent nothing yet, and the
    conference began only `since_s` ago [s]."""
    return status.device in simulated and status.frames == 0 and since_s < STARTING_S


def cause(status: DeviceStatus) -> str:
    """What the device says, without the port of a simulated one: that is in a folder of the run, and tells nobody anything."""
    return re.sub(rf"^\S+/dev/{re.escape(status.device)}: ", "", status.detail)

"""The simulator of a guest's page (`DeviceKind.simulator`): somebody enters, looks round and waves now and then."""

import math

from vistel.conference.device_list import Device
from vistel.conference.files import public_avatar
from vistel.protocol.pointer import guest_record, posture_record
from vistel.v1.device_pb2 import PointerFrame
from vistel_sim.phone import SimulatedSender, sender
from vistel_sim.simulation import Simulation

WAVES_EVERY_S = 9.0
"""From one wave to the next [s]."""
WHO_EVERY = 15
"""Of so many packets one says who the guest is, as the gateway does."""


def page(device: Device, simulation: Simulation) -> SimulatedSender:
    """A page with a guest at it."""
    who = device.participant
    assert who is not None

    def packet(frame: int, t_s: float) -> bytes:
        if frame % WHO_EVERY == 0:
            return guest_record(who.display_name or who.name, public_avatar(who.avatar))
        yaw, number = 0.5 * math.sin(0.4 * t_s), int(t_s / WAVES_EVERY_S)
        return posture_record(yaw, -0.15, gesture=PointerFrame.GESTURE_WAVE if number else 0, number=number)

    return sender(device.name, packet, simulation)

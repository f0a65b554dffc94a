"""Which kind of device sends some bytes. It names a device that is plugged in at the wrong place."""

import re

from vistel.devices.kind import DeviceKind
from vistel.devices.registry import kinds

_OSC = rb"#bundle\x00|/[\x21-\x7e]+\x00{1,4},[ifsbTF]*\x00"
"""Packets of any program that speaks OSC."""


def identify(data: bytes) -> DeviceKind | None:
    """The kind of the device on a serial port; None when the bytes could be of several kinds."""
    return _of_connection("serial", data)


def identify_sender(packets: bytes) -> str | None:
    """The sender of UDP packets, in words; None for an unknown one."""
    kind = _of_connection("udp", packets)
    if kind is not None:
        return kind.title
    return "a program that speaks OSC" if re.search(_OSC, packets) else None


def questions() -> list[bytes]:
    """What makes devices on serial ports identify themselves. No question changes a device of a known kind."""
    return [k.question for k in kinds() if k.question]


def _of_connection(connection: str, data: bytes) -> DeviceKind | None:
    # In the order of the kinds: hardly anything looks like a tracker's records, while two bytes of a float can look like an answer
    # of a CyberGlove.
    return next(
        (k for k in kinds() if connection in k.connections and any(re.search(s, data, re.DOTALL) for s in k.signatures)), None
    )

"""What this machine has to connect devices with (`DeviceKind.doctor`)."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

from serial.tools import list_ports

from vistel.devices.kind import Finding
from vistel.protocol.fivedt import VENDOR_ID


def serial_ports() -> Finding:
    """Serial ports, and whether they may be opened."""
    ports = [p.device for p in list_ports.comports()]
    if not ports:
        return Finding("Serial ports", "absent", "none", "simulated FASTRAK and CyberGloves on pseudo-terminals")
    locked = [p for p in ports if not os.access(p, os.R_OK | os.W_OK)]
    hint = f"no permission for {', '.join(locked)}: add yourself to group dialout" if locked else ""
    return Finding("Serial ports", "found", ", ".join(ports), hint)


def hid_gloves() -> Finding:
    """5DT gloves on USB."""
    if importlib.util.find_spec("hid") is None:
        return Finding("HID devices", "absent", "hidapi is not installed", "gloves on serial ports or simulated")
    import hid  # noqa: PLC0415  not everybody has it

    gloves = [d for d in hid.enumerate() if d["vendor_id"] == VENDOR_ID]
    if gloves:
        return Finding("HID gloves", "found", ", ".join(d["product_string"] or "5DT glove" for d in gloves))
    return Finding("HID gloves", "absent", "no 5DT glove on USB", "gloves on serial ports or simulated")


def cameras() -> Finding:
    """The system's cameras (Linux)."""
    found = sorted(str(p) for p in Path("/dev").glob("video*"))
    if found:
        return Finding("Cameras", "found", ", ".join(found))
    return Finding("Cameras", "absent", "no /dev/video*", "faces stay at rest, gaze follows the motion source")

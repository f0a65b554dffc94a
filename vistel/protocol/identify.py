"""Which device talks on a port, from what it says; for naming a device that is plugged in at the wrong place."""

from __future__ import annotations

import re


def identify(data: bytes) -> str | None:
    """A device's name, or None when its bytes could be anyone's."""
    if b"*ERROR*" in data or re.search(rb"2[ 1-4]S[0-9A-F]{3}.{45,47}\r\n", data, re.DOTALL):
        return "a Polhemus FASTRAK"
    if b"CyberGlove" in data or b"e?" in data or re.search(rb"\?[GS].\x00", data, re.DOTALL):
        return "a CyberGlove"
    if re.search(rb"S[^\x00]{18}(?:[^\x00]{4})?\x00S", data):
        return "a CyberGlove"
    if re.search(rb"0[1-4][ A-Za-z].{28}\r\n0[1-4]", data, re.DOTALL):
        return "a Polhemus FASTRAK"
    return None

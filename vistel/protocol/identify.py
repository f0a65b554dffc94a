"""Which device talks on a port, from what it says; for naming a device that is plugged in at the wrong place."""

from __future__ import annotations

import re

_FASTRAK = "a Polhemus FASTRAK"
_KNOWN = (
    ("a Polhemus LIBERTY", re.compile(rb"LY[\x00-\x10][\x15\x16CP]...[\x00-\x02]", re.DOTALL)),
    ("a Polhemus PATRIOT", re.compile(rb"PA[\x00-\x02][\x15\x16CP]...[\x00-\x02]", re.DOTALL)),
    ("a Polhemus LIBERTY", re.compile(rb"00v.{0,120}LIBERTY", re.DOTALL)),
    ("a Polhemus PATRIOT", re.compile(rb"00v.{0,120}PATRIOT", re.DOTALL)),
    (_FASTRAK, re.compile(rb"2[ 1-4]E\*ERROR\*")),
    (_FASTRAK, re.compile(rb"2[ 1-4]S[0-9A-F]{3}.{45,47}\r\n", re.DOTALL)),  # status
    (_FASTRAK, re.compile(rb"0[1-4][ A-Za-z].{28}\r\n0[1-4]", re.DOTALL)),  # binary records
    ("a 5DT Data Glove Ultra", re.compile(rb"<[\x00-\x07\x10-\x17].{26}><[\x00-\x07\x10-\x17].{26}>", re.DOTALL)),
    ("a 5DT Data Glove 16", re.compile(rb"<D(?:[\x00-\x0f].){16}..<[DI]", re.DOTALL)),
    ("a 5DT Data Glove 5", re.compile(rb"BR..[\x00-\x03][\x00-\x1f].{10}[\x20-\x7e]{4}", re.DOTALL)),  # what it is
    ("a 5DT Data Glove 5", re.compile(rb"(?:\x80.{8}){6}", re.DOTALL)),  # records
)
_CYBERGLOVE = (
    re.compile(rb"CyberGlove"),
    re.compile(rb"e\?(?:\r\n)?\x00"),  # unknown command
    re.compile(rb"\?[GS][\x00-\x1f]\x00"),
    re.compile(rb"S[^\x00]{18}(?:[^\x00]{4})?[\x80-\xff]?\x00S"),  # samples
)
_SENDERS = (
    ("Live Link Face", re.compile(rb"\x06\x00\x00\x00[\x01-\x80][\x20-\x7e]")),
    ("a VMC tracking suite", re.compile(rb"/VMC/Ext/")),
    ("a program that speaks OSC", re.compile(rb"#bundle\x00|/[\x21-\x7e]+\x00{1,4},[ifsbTF]*\x00")),
)


def identify(data: bytes) -> str | None:
    """A device's name, or None when its bytes could be anyone's.

    Trackers first: two bytes of a float can look like a glove's "e?", hardly anything looks like their records.
    """
    for name, pattern in _KNOWN:
        if pattern.search(data):
            return name
    return "a CyberGlove" if any(p.search(data) for p in _CYBERGLOVE) else None


def identify_sender(packets: bytes) -> str | None:
    """Who sends these UDP packets, or None."""
    return next((name for name, pattern in _SENDERS if pattern.search(packets)), None)

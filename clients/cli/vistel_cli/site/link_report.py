"""`vistel doctor FILE --site NAME`: before a meeting, how good the link of a site to its router is, and what that means for it."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from vistel.wire.clock import SystemClock
from vistel.wire.link_quality import LinkQuality, measure_link
from vistel.wire.zenoh.endpoints import is_local
from vistel_cli.conference_choice import endpoint_of, on_bus
from vistel_cli.site.link import check_link
from vistel_cli.terminal import FAILED, USAGE, err, fail, load_conference, out

if TYPE_CHECKING:
    from vistel.conference.model import Conference

PERSON_BIT_S = 52e3
"""Of one participant on the link: motion, 27 kbit/s, and voice, 25 kbit/s (docs/performance-history.md)."""
ROOM_BIT_S = 20e3
"""What a site receives of the room at most with few people (docs/performance.md)."""
AMPLE = 1.5
"""With so many times the rate that is needed nothing waits for long."""
FAST_BIT_S = 100e6
"""Faster links are not told apart: what is sent to measure them is there too soon."""
FEW_LOST = 0.005
"""Losses that nobody notices."""


def report(file: Path, site: str | None, hub: str | None, as_json: bool) -> int:
    """Measure, and print what was found. Returns the exit code, 1 where the link carries too little."""
    conference = load_conference(file, room_elsewhere=True)
    names = [s.name for s in conference.sites]
    if site not in names:
        fail(f"{file}: whose link? --site with one of {', '.join(names)}{f'; {site} is none of them' if site else ''}", USAGE)
    endpoint = endpoint_of(conference, hub)
    check_link(conference, site, endpoint)
    err.print(f"measuring the link to {endpoint}, about ten seconds")
    clock = SystemClock()
    found = on_bus(conference, site, endpoint, lambda bus: measure_link(bus, clock))
    if found is None:
        fail(f"{endpoint}: no clock answers; start the router with vistel up or vistel site router, not with zenohd alone")
    enough, lines = meaning(conference, site, endpoint, found)
    if as_json:
        print(json.dumps({"site": site, "router": endpoint, **asdict(found), "enough": enough, "meaning": lines}))
    else:
        table = Table(box=None, show_header=False)
        for name, text in _rows(found):
            table.add_row(name, text)
        out.print(table)
        out.print("\nFor the meeting this means:")
        for line in lines:
            out.print(f"- {line}", soft_wrap=True)
    return 0 if enough else FAILED


def _rows(found: LinkQuality) -> list[tuple[str, str]]:
    lost = (
        f"about {found.loss:.1%} of the packets, judged by late answers; a busy machine answers late, too" if found.loss else "none"
    )
    return [
        ("certificate, port, version", "accepted"),
        ("round trip", f"{_ms(found.round_trip_s)}, {_ms(found.round_trip_s + found.jitter_s)} for 95 of 100"),
        ("lost", lost + (f"; {found.unanswered} questions were never answered" if found.unanswered else "")),
        ("to the router", _rate(found.up_bit_s)),
        ("from the router", _rate(found.down_bit_s)),
    ]


def meaning(conference: Conference, site: str, endpoint: str, found: LinkQuality) -> tuple[bool, list[str]]:
    """Whether the link carries the meeting, and in plain lines how well."""
    here = sum(len(s.participants) for s in conference.sites if s.name == site)
    others = sum(len(s.participants) for s in conference.sites if s.name != site)
    up, said_up = _carries("send", found.up_bit_s, here * PERSON_BIT_S)
    down, said_down = _carries("receive", found.down_bit_s, others * PERSON_BIT_S + ROOM_BIT_S)
    lines = [said_up, said_down, _lateness(conference, found)]
    if found.loss > FEW_LOST and "quic/" not in endpoint and not all(map(is_local, endpoint.split(","))):
        lines.append(
            f"What is lost is sent again, and all behind it waits {_ms(found.round_trip_s)} or more: figures stop and jump."
            " Over QUIC they do not: let UDP pass, and name quic/HOST:PORT first in [bus] endpoints."
        )
    return up and down, lines


def _carries(what: str, bit_s: float | None, needed_bit_s: float) -> tuple[bool, str]:
    needs = f"This site has to {what} about {needed_bit_s / 1e3:.0f} kbit/s"
    if bit_s is None:
        return True, f"{needs}; whether the link carries that was not measured: try again when nobody else does."
    if bit_s >= AMPLE * needed_bit_s:
        return True, f"{needs}: the link carries that."
    if bit_s >= needed_bit_s:
        return True, f"{needs}: the link carries just that. Let nothing else use it during the meeting."
    return False, f"{needs}: the link carries less. Voices will break and figures stop; use another link, or fewer people."


def _lateness(conference: Conference, found: LinkQuality) -> str:
    waits_s = conference.playout.delay
    half_s = found.round_trip_s / 2
    most_s = half_s + found.jitter_s
    if most_s <= waits_s:
        return f"Motion arrives after {_ms(half_s)} to {_ms(most_s)}, in time: figures are shown {_ms(waits_s)} after people move."
    return (
        f"Motion arrives after {_ms(half_s)} to {_ms(most_s)}, but figures are shown {_ms(waits_s)} after people move. Until it"
        " arrives it is predicted, and fast moves look wrong for a moment. Where that disturbs:"
        f" delay = {most_s:.2f} under [playout]."
    )


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms" if seconds >= 0.01 else f"{1e3 * seconds:.1f} ms"


def _rate(bit_s: float | None) -> str:
    if bit_s is None:
        return "not measured"
    if bit_s > FAST_BIT_S:
        return f"more than {FAST_BIT_S / 1e6:.0f} Mbit/s"
    return f"at least {bit_s / 1e6:.1f} Mbit/s" if bit_s >= 1e6 else f"{bit_s / 1e3:.0f} kbit/s"

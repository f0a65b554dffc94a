"""`vistel doctor FILE --site NAME`: before a meeting, how good the link of a site to its router is, and what that means for it."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from vistel.conference.connect import tls_files
from vistel.conference.model import HUB_PLACE
from vistel.wire.clock import SystemClock
from vistel.wire.link.quality import LinkQuality, measure_link
from vistel.wire.zenoh.endpoints import is_local
from vistel_cli.conference_choice import endpoint_of, on_bus
from vistel_cli.site.link import check_link
from vistel_cli.terminal import FAILED, USAGE, err, fail, load_conference, out

if TYPE_CHECKING:
    from vistel.conference.model import Conference
    from vistel.wire.bus import Bus
    from vistel.wire.zenoh.config import TlsFiles

PERSON_BIT_S = 52e3
"""Of one participant on the link: motion, 27 kbit/s, and voice, 25 kbit/s (docs/performance-history.md)."""
LEAST_PERSON_BIT_S = 33e3
"""The same where the uplink is thin and as little is sent as can be (docs/explanation/networks.md)."""
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
        fail(f"{file}: {f'no site is called {site!r}; ' if site else ''}expected --site with one of {', '.join(names)}", USAGE)
    endpoint = endpoint_of(conference, hub)
    check_link(conference, site, endpoint)
    err.print(f"measuring the link to {endpoint}, about ten seconds")
    clock = SystemClock()
    from vistel.wire.certificates.signer import TOKEN

    signers: set[str] = set()

    async def measured(bus: Bus) -> LinkQuality | None:
        bus.watch_presence(lambda place, token, _: signers.add(token) if place == HUB_PLACE else None)
        return await measure_link(bus, clock)

    found = on_bus(conference, site, endpoint, measured)
    if found is None:
        fail(f"{endpoint}: no clock answers; start the router with vistel up or vistel site router, not with zenohd alone")
    enough, lines = meaning(conference, site, endpoint, found)
    files = tls_files(conference, site)
    row, line = certificate_end(files, TOKEN in signers, datetime.now(UTC)) if files else ("", "")
    lines += filter(None, [line])
    if as_json:
        about = {"site": site, "router": endpoint, "certificate": row}
        print(json.dumps({**about, **asdict(found), "enough": enough, "meaning": lines}))
    else:
        table = Table(box=None, show_header=False)
        for name, text in _rows(found, row):
            table.add_row(name, text)
        out.print(table)
        out.print("\nFor the meeting this means:")
        for line in lines:
            out.print(f"- {line}", soft_wrap=True)
    return 0 if enough else FAILED


def certificate_end(files: TlsFiles, signed: bool, now: datetime) -> tuple[str, str]:
    """Until when the certificate is good, and what that means for the meeting where it ends soon. signed: somebody is there who
    renews it."""
    from vistel.wire.certificates.authority import lifetime, read_certificate
    from vistel.wire.certificates.renewal import RENEWED_IN_LAST, ending

    certificate = read_certificate(files.certificate)
    until = certificate.not_valid_after_utc
    begins = until - lifetime(certificate) * RENEWED_IN_LAST
    by_itself = f"renewed by itself {f'from {begins:%Y-%m-%d} on' if begins > now else 'when the site joins'}"
    row = f"until {until:%Y-%m-%d}, {(until - now).days} days; {by_itself if signed else 'nobody who renews it is there now'}"
    return row, "" if signed else ending(files, now, "nobody who signs is there now")


def _rows(found: LinkQuality, certificate: str) -> list[tuple[str, str]]:
    lost = (
        f"about {found.loss:.1%} of the packets, judged by late answers; a busy machine answers late, too" if found.loss else "none"
    )
    return [
        ("certificate, port, version", "accepted"),
        *([("certificate", certificate)] if certificate else []),
        ("round trip", f"{_ms(found.round_trip_s)}, {_ms(found.round_trip_s + found.jitter_s)} for 95 of 100"),
        ("lost", lost + (f"; {found.unanswered} questions were never answered" if found.unanswered else "")),
        ("to the router", _rate(found.up_bit_s)),
        ("from the router", _rate(found.down_bit_s)),
    ]


def meaning(conference: Conference, site: str, endpoint: str, found: LinkQuality) -> tuple[bool, list[str]]:
    """Whether the link carries the meeting, and in plain lines how well."""
    here = sum(len(s.participants) for s in conference.sites if s.name == site)
    others = sum(len(s.participants) for s in conference.sites if s.name != site)
    up, said_up = _carries("send", found.up_bit_s, here * PERSON_BIT_S, here * LEAST_PERSON_BIT_S)
    down, said_down = _carries("receive", found.down_bit_s, others * PERSON_BIT_S + ROOM_BIT_S)
    lines = [said_up, said_down, _lateness(conference, found)]
    if found.loss > FEW_LOST and "quic/" not in endpoint and not all(map(is_local, endpoint.split(","))):
        lines.append(
            f"What is lost is sent again, and all behind it waits {_ms(found.round_trip_s)} or more: figures stop and jump."
            " Over QUIC they do not: let UDP pass, and name quic/HOST:PORT first in [bus] endpoints."
        )
    return up and down, lines


def _carries(what: str, bit_s: float | None, needed_bit_s: float, least_bit_s: float = math.inf) -> tuple[bool, str]:
    needs = f"This site has to {what} about {needed_bit_s / 1e3:.0f} kbit/s"
    if bit_s is None:
        return True, f"{needs}; whether the link carries that was not measured: try again when nobody else does."
    if bit_s >= AMPLE * needed_bit_s:
        return True, f"{needs}: the link carries that."
    if bit_s >= needed_bit_s:
        return True, f"{needs}: the link carries just that. Let nothing else use it during the meeting."
    if bit_s >= least_bit_s:
        return (True, f"{needs}: the link carries less. Fewer frames of motion and poorer voices go; devices are not recorded.")
    return False, f"{needs}: the link carries less. Voices will break and figures stop; use another link, or fewer people."


def _lateness(conference: Conference, found: LinkQuality) -> str:
    waits_s, auto = conference.playout.longest_s, conference.playout.delay == "auto"
    half_s = found.round_trip_s / 2
    most_s = half_s + found.jitter_s
    if most_s <= waits_s:
        shown = f"about {_ms(most_s)}" if auto else _ms(waits_s)
        return f"Motion arrives after {_ms(half_s)} to {_ms(most_s)}, in time: figures are shown {shown} after people move."
    return (
        f"Motion arrives after {_ms(half_s)} to {_ms(most_s)}, but is waited for {_ms(waits_s)} at most. Until it"
        " arrives it is predicted, and fast moves look wrong for a moment. Where that disturbs:"
        f" {'most' if auto else 'delay'} = {most_s:.2f} under [playout]."
    )


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms" if seconds >= 0.01 else f"{1e3 * seconds:.1f} ms"


def _rate(bit_s: float | None) -> str:
    if bit_s is None:
        return "not measured"
    if bit_s > FAST_BIT_S:
        return f"more than {FAST_BIT_S / 1e6:.0f} Mbit/s"
    return f"at least {bit_s / 1e6:.1f} Mbit/s" if bit_s >= 1e6 else f"{bit_s / 1e3:.0f} kbit/s"

"""Where browsers see what sites see, as it is printed when they start."""

from __future__ import annotations

import socket
from collections.abc import Iterable
from datetime import datetime

from vistel.conference.console import ConsoleConfig
from vistel.conference.model import Conference, Site


def pages_of(sites: Iterable[Site], now: datetime) -> dict[str, str]:
    """The page of each site that has one, by its name; with the certificate's fingerprint where no authority has signed that, for
    viewers to compare."""
    return {s.name: s.display.stream_page + _certificate(s, now) for s in sites if s.draws and s.display.stream_page}


CONSOLE_PORT = 8440
"""Of the console of `vistel up`, where it is free: an address that people can remember."""


def with_console(conference: Conference) -> Conference:
    """The conference with a console on this machine alone, where its file does not say where: at a port that is free and that the
    file names for nothing else."""
    if conference.console.at:
        return conference
    from vistel_cli.run.checks import ports_of  # loads slowly

    port = _free_port(0 if CONSOLE_PORT in ports_of(conference) else CONSOLE_PORT)
    return conference.model_copy(update={"console": ConsoleConfig(at=f"127.0.0.1:{port}")})


def console_line(console: ConsoleConfig) -> dict[str, str]:
    """What is said of it at the start."""
    if not console.page:
        return {}
    from vistel_services.console.bundle import bundle_missing

    return {"console": console.page + ("  its page is not made yet: make web" if bundle_missing() else "")}


def guests_line(conference: Conference) -> dict[str, str]:
    """How guests get into the seats that the file has for them."""
    seats = sum(p.by_link for site in conference.sites for p in site.participants)
    if not seats or not conference.console.page:
        return {}
    return {"guests": f"{seats} {'seat' if seats == 1 else 'seats'}; a link for one: vistel invite NAME"}


def _free_port(wanted: int) -> int:
    with socket.socket() as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind(("127.0.0.1", wanted))
        except OSError:
            tried.bind(("127.0.0.1", 0))
        return int(tried.getsockname()[1])


def _certificate(site: Site, now: datetime) -> str:
    if not site.display.stream_https:
        return ""
    from vistel.wire.certificates.authority import read_certificate
    from vistel.wire.certificates.errors import CertificateError
    from vistel.wire.certificates.server import fingerprint
    from vistel_services.serving.address import stream_address, with_certificate

    try:
        address = stream_address(site.display)
        shown = address and with_certificate(address, site.name, now).certificate
        certificate = shown and read_certificate(shown.certificate)
    except CertificateError:  # the renderer says so
        return ""
    own = certificate is not None and certificate.issuer == certificate.subject
    return f"  certificate SHA-256 {fingerprint(certificate)}" if certificate and own else ""

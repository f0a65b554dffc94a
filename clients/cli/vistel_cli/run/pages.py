"""Where browsers see what sites see, as it is printed when they start."""

from __future__ import annotations

import errno
import socket
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from typing import TYPE_CHECKING

from vistel.conference.console import ConsoleConfig, certificate_name
from vistel.conference.model import Conference, Site

if TYPE_CHECKING:
    from vistel_services.serving.address import PageAddress


def pages_of(sites: Iterable[Site], now: datetime) -> dict[str, str]:
    """The page of each site that has one, by its name; with the certificate's fingerprint where no authority has signed that, for
    viewers to compare."""
    from vistel_services.serving.address import stream_address

    shown = {s.name: (s.display.stream_page, stream_address(s.display)) for s in sites if s.draws and s.display.stream_page}
    return {name: page + _certificate(address, name, now) for name, (page, address) in shown.items()}


CONSOLE_PORT = 8440
"""Of the console of `vistel up`, where it is free: an address that people can remember."""
MORE_TRIES = 8
"""At ports that the system chooses; each may be somebody's by the time it is claimed."""


@contextmanager
def with_console(conference: Conference) -> Iterator[Conference]:
    """The conference with a console on this machine alone, where its file does not say where: at a port that is free, that the file
    names for nothing else, and that no other conference chooses within the block, although the console opens it only later."""
    if conference.console.at:
        yield conference
        return
    from vistel_cli.run.checks import ports_of  # loads slowly

    with ExitStack() as held:
        port = _chosen_port(held, 0 if CONSOLE_PORT in ports_of(conference) else CONSOLE_PORT)
        yield conference.model_copy(update={"console": ConsoleConfig(at=f"127.0.0.1:{port}")})


def console_line(conference: Conference, now: datetime) -> dict[str, str]:
    """What is said of the console at the start; its certificate as those of the sites' pages."""
    if not conference.console.page:
        return {}
    from vistel_services.console.bundle import bundle_missing
    from vistel_services.serving.address import console_address

    missing = "  its page is not made yet: make web" if bundle_missing() else ""
    certificate = _certificate(console_address(conference.console), certificate_name(conference.name), now)
    return {"console": conference.console.page + certificate + missing}


def guests_line(conference: Conference) -> dict[str, str]:
    """How guests get into the seats that the file has for them."""
    seats = sum(p.by_link for site in conference.sites for p in site.participants)
    if not seats or not conference.console.page:
        return {}
    return {"guests": f"{seats} {'seat' if seats == 1 else 'seats'}; a link for one: vistel invite NAME"}


def _chosen_port(held: ExitStack, wanted: int) -> int:
    """A free TCP port of this machine, `wanted` if that can be had. Until `held` ends, the UDP port of the same number, which
    nothing uses, tells other conferences that it is taken: two TCP sockets could both be bound to it before either listens."""
    for port in (wanted, *(0,) * MORE_TRIES):
        with socket.socket() as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # what a program that has ended left behind is free
            claim = held.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            with suppress(OSError):
                tried.bind(("127.0.0.1", port))
                claim.bind(tried.getsockname())
                return int(claim.getsockname()[1])
    raise OSError(errno.EADDRINUSE, "no port of this machine is free for the console: --no-console")


def _certificate(address: PageAddress | None, name: str, now: datetime) -> str:
    """name: under which the certificate is kept."""
    from vistel.wire.certificates.authority import read_certificate
    from vistel.wire.certificates.errors import CertificateError
    from vistel.wire.certificates.server import fingerprint
    from vistel_services.serving.address import with_certificate

    try:
        shown = address and with_certificate(address, name, now).certificate
        certificate = shown and read_certificate(shown.certificate)
    except CertificateError:  # who serves the page says so
        return ""
    own = certificate is not None and certificate.issuer == certificate.subject
    return f"  certificate SHA-256 {fingerprint(certificate)}" if certificate and own else ""

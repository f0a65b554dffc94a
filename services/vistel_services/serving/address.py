"""Where a page is served, and whom its server answers: pages of other sites must not look in."""

from __future__ import annotations

import ipaddress
import socket
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from vistel.conference.console import ConsoleConfig
from vistel.conference.display import Display
from vistel.conference.page_address import page_at
from vistel.figure.avatar.cache_folder import default_state
from vistel.wire.certificates.errors import CertificateError

if TYPE_CHECKING:
    from vistel.wire.certificates.server import ServerFiles


@dataclass(frozen=True)
class PageAddress:
    """host: of this machine, an address or a name; port: 0 takes a free one; token: what readers show, "" for none; certificate:
    of HTTPS, None for plain HTTP; insecure: plain HTTP beyond this machine is meant; host_token: what the host shows."""

    host: str
    port: int
    token: str = field(default="", repr=False)
    certificate: ServerFiles | None = None
    insecure: bool = False
    host_token: str = field(default="", repr=False)

    @property
    def local(self) -> bool:
        """Only this machine reaches it."""
        return _is_local(self.host)

    @property
    def url(self) -> str:
        """Of its page."""
        return f"{'http' if self.certificate is None else 'https'}://{self}/"

    @property
    def needs_certificate(self) -> bool:
        """Whether it would be plain HTTP beyond this machine, which nobody has meant."""
        return self.certificate is None and not self.local and not self.insecure

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def stream_address(shown: Display) -> PageAddress | None:
    """Of a site's stream, with the certificate that the conference file names; None where there is no stream."""
    if not shown.stream_at:
        return None
    from vistel.wire.certificates.server import ServerFiles

    named = shown.stream_tls and ServerFiles(shown.stream_tls.certificate, shown.stream_tls.key)
    return PageAddress(*shown.stream_at, shown.stream_token, named, shown.stream_insecure)


def console_address(shown: ConsoleConfig) -> PageAddress:
    """Of the console, with the certificate that the conference file names."""
    from vistel.wire.certificates.server import ServerFiles

    named = shown.tls and ServerFiles(shown.tls.certificate, shown.tls.key)
    return PageAddress(*(page_at(shown.at) or ("127.0.0.1", 0)), shown.token, named, shown.insecure, shown.host_token)


def with_certificate(address: PageAddress, site: str, now: datetime, folder: Path | None = None) -> PageAddress:
    """The address with a certificate of its own, where it needs one and the file names none. folder: where that lies, in the user's
    state folder by default. Raises CertificateError where none can be kept."""
    if not address.needs_certificate:
        return address
    from vistel.wire.certificates.server import own_certificate

    kept = default_state() / "streams" if folder is None else folder
    hosts = sorted({h for h in (*own_names(), address.host) if h.isascii() and not _is_any(h)})
    try:
        return replace(address, certificate=own_certificate(kept, site, hosts, now))
    except OSError as e:
        raise CertificateError(
            f"{address}: plain HTTP beyond this machine, where everybody on the way reads the token and sees the picture, and no "
            f"certificate can be kept in {kept} ({e.strerror}); name one (stream_tls), or say that plain HTTP is meant: "
            "stream_insecure = true"
        ) from e


def answered(host: str | None, origin: str | None, names: frozenset[str] = frozenset()) -> bool:
    """Whether a request with these headers is meant for this server and comes from no other site's page.

    A page elsewhere cannot choose its Origin, and a name that somebody else points here (DNS rebinding) stands in Host: so Host is
    an address, a name of this machine or one of `names`, and Origin, where a browser sends one, is the same place.
    """
    if not host:
        return False
    name = _name_of(f"//{host}")
    if name is None:
        return False
    known = {*own_names(), *names}
    if not (_is_address(name) or name in known or f"*.{name.partition('.')[2]}" in known):
        return False
    return origin is None or (origin.startswith(("http://", "https://")) and urlsplit(origin).netloc.lower() == host.lower())


def own_names() -> frozenset[str]:
    """Names under which this machine is found."""
    own = socket.gethostname().lower()
    return frozenset({"localhost", own, f"{own}.local"})


def _name_of(url: str) -> str | None:
    try:
        return urlsplit(url).hostname
    except ValueError:
        return None


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _is_local(name: str) -> bool:
    return name == "localhost" or (_is_address(name) and ipaddress.ip_address(name).is_loopback)


def _is_any(name: str) -> bool:
    return _is_address(name) and ipaddress.ip_address(name).is_unspecified

"""Where a stream is served, and whom its server answers: pages of other sites must not look in."""

from __future__ import annotations

import hmac
import ipaddress
import socket
from dataclasses import dataclass, field
from urllib.parse import urlsplit


@dataclass(frozen=True)
class StreamAddress:
    """host: of this machine, an address or a name; port: 0 takes a free one; token: what readers show, "" for none."""

    host: str
    port: int
    token: str = field(default="", repr=False)

    @property
    def local(self) -> bool:
        """Only this machine reaches it."""
        return _is_local(self.host)

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def admitted(token: str, shown: str | None) -> bool:
    """Whether who shows `shown` may read a stream with this token."""
    return not token or hmac.compare_digest(token.encode(), (shown or "").encode())


def answered(host: str | None, origin: str | None) -> bool:
    """Whether a request with these headers is meant for this server and comes from no other site's page.

    A page elsewhere cannot choose its Origin, and a name that somebody else points here (DNS rebinding) stands in Host: so Host is
    an address, or a name of this machine, and Origin, where a browser sends one, is the same place.
    """
    if not host:
        return False
    name = _name_of(f"//{host}")
    if name is None or not (_is_address(name) or name in _own_names()):
        return False
    return origin is None or (origin.startswith(("http://", "https://")) and urlsplit(origin).netloc.lower() == host.lower())


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


def _own_names() -> frozenset[str]:
    own = socket.gethostname().lower()
    return frozenset({"localhost", own, f"{own}.local"})

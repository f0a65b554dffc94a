"""Where a page for browsers is served: as a conference file names it, and how browsers find it."""

import re
from pathlib import Path

from vistel.conference.devices import Checked
from vistel.wire.zenoh.endpoints import is_local

TOKEN = r"^$|^[A-Za-z0-9_\-]{16,64}$"
"""What a token is made of; empty: none."""
_ADDRESS = re.compile(r"((\[[0-9a-fA-F:.]+\]|[\w.-]+):)?(?P<port>\d{1,5})")


class StreamTls(Checked):
    """What a stream shows over HTTPS (PEM): a certificate, with those up to its authority, and its key without a password."""

    certificate: Path
    key: Path


def checked_page(at: str) -> str:
    """An address and a port, a port of this machine only, or empty. Raises ValueError for anything else."""
    if at and not ((found := _ADDRESS.fullmatch(at)) and int(found["port"]) < 65536):
        raise ValueError(f'expected an address and a port, such as "127.0.0.1:8090", or a port, got "{at}"')
    return at


def page_at(at: str) -> tuple[str, int] | None:
    """Host and port."""
    if not at:
        return None
    host, _, port = at.rpartition(":")
    return host.removeprefix("[").removesuffix("]") or "127.0.0.1", int(port)


def page_is_local(at: str) -> bool:
    """Only this machine reaches it."""
    host, port = page_at(at) or ("127.0.0.1", 0)
    return is_local(f"tcp/[{host}]:{port}")


def page_url(at: str, *, https: bool) -> str:
    """What a browser of the same machine opens; empty for no page, or for one at any free port."""
    host, port = page_at(at) or ("", 0)
    here = "127.0.0.1" if host == "0.0.0.0" else f"[{host}]" if ":" in host else host
    return f"{'https' if https else 'http'}://{here}:{port}/" if port else ""

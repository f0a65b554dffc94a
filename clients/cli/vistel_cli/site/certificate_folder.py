"""Where a conference's certificates are, and who may have one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vistel.conference.model import RESERVED, Conference
from vistel.wire.zenoh.endpoints import host_and_port
from vistel_cli.terminal import USAGE, fail

if TYPE_CHECKING:
    from vistel.wire.certificates.authority import Authority

STANDARD_HOSTS = ("localhost", "127.0.0.1", "::1")
"""Addresses of the hub on its own machine."""


def folder_of(conference: Conference) -> Path:
    """The folder of certificates that the file names. Ends the command where it names none."""
    tls = conference.bus.tls
    if tls is None or tls.folder is None:
        fail(
            'certificates: put these lines under [bus]: mode = "routed", endpoints = ["quic/HOST:7447", "tls/HOST:7447"] and '
            'tls = { folder = "certificates" }',
            USAGE,
        )
    return tls.folder


def authority_of(conference: Conference) -> Authority:
    """Ends the command where there is none."""
    from vistel.wire.certificates.authority import Authority
    from vistel.wire.certificates.errors import CertificateError

    try:
        return Authority(folder_of(conference))
    except CertificateError as e:
        fail(f"{e}; vistel site certs init makes the authority, on the hub's machine")


def hosts_of(conference: Conference) -> list[str]:
    """Addresses at which the hub's router is found."""
    return list(dict.fromkeys([*(host_and_port(e)[0] for e in conference.bus.endpoints), *STANDARD_HOSTS]))


def check_name(conference: Conference, name: str) -> None:
    """Ends the command where the file gives nobody this name."""
    known = [*(s.name for s in conference.sites), *conference.observers, *RESERVED]
    if name not in known:
        fail(f"{name}: no site or observer of the conference; expected one of {', '.join(known)}", USAGE)

"""The lease that a conference file names."""

from __future__ import annotations

import ssl
from pathlib import Path

from vistel.wire.clock import Clock
from vistel.wire.lease.file import FileLease
from vistel.wire.lease.lease import Lease
from vistel.wire.zenoh.config import TlsFiles


def open_lease(kind: str, file: Path | None, conference: str, place: str, clock: Clock, files: TlsFiles | None) -> Lease:
    """The lease of a conference's room for the world at `place`. kind: as `[world] lease`; file: of a lease "file"; None: one that
    nobody else can have; files: certificates for an etcd on another machine."""
    if kind == "file":
        return FileLease(file, place)
    # aiohttp takes a while to load, and on one machine nobody needs it.
    if kind == "kubernetes":
        from vistel.wire.lease.kubernetes import KubernetesLease  # noqa: PLC0415

        return KubernetesLease(conference, place, clock)
    from vistel.wire.lease.etcd import EtcdLease  # noqa: PLC0415

    tls = None
    if files is not None:
        tls = ssl.create_default_context(cafile=files.ca)
        tls.load_cert_chain(files.certificate, files.key)
    members = kind.removeprefix("etcd://").split(",")
    return EtcdLease([f"{'http' if tls is None else 'https'}://{m}" for m in members], conference, place, tls)

"""Keeps certificates good while a command runs: renews this machine's own, and where the authority is, signs for the others."""

from __future__ import annotations

import logging
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from vistel.conference.connect import connect, tls_files
from vistel.conference.model import RESERVED, Conference
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import BusError
from vistel_cli.terminal import out

if TYPE_CHECKING:
    from vistel.v1.service_pb2 import CertificateReply, CertificateRequest
    from vistel.wire.bus import Bus
    from vistel.wire.certificates.authority import Authority
    from vistel.wire.certificates.renewal import Ask
    from vistel.wire.zenoh.config import TlsFiles

log = logging.getLogger("vistel.certificates")

ANSWER_S = 3.0
"""For the host to answer."""


async def keep_certificate(conference: Conference, place: str, endpoint: str) -> None:
    """Renew the certificate that `place` shows at the router `endpoint` whenever it is due, until cancelled."""
    try:
        files = tls_files(conference, place)
    except BusError:  # the processes say so themselves
        return
    if files is not None:
        await _keep(files, asking_at(conference, place, endpoint, files))


def start_certificates(conference: Conference, bus: Bus, files: TlsFiles | None, *, routes: bool) -> None:
    """The same beside a router or a clock, over its own connection `bus`. Where the authority is, sign for others and publish what
    was revoked; routes: elsewhere keep a list of that."""
    if files is None:
        return
    from vistel.wire.certificates.revocations import follow_revocations

    if (authority := authority_beside(files)) is not None:
        background.start(serve_authority(conference, bus, authority), "authority")
        background.start(_keep(files, asking_here(authority, files)), "certificate")
        return
    background.start(_keep(files, asking_on(bus, files)), "certificate")
    if routes:
        background.start(follow_revocations(bus, files.ca.parent, holders_of(conference), _tell), "revocations")


async def serve_authority(conference: Conference, bus: Bus, authority: Authority) -> None:
    """Sign for those who renew their certificates, and publish which count no more, until cancelled."""
    from vistel.wire.certificates.revocations import publish_revocations
    from vistel.wire.certificates.signer import Signer

    Signer(authority, now, _tell).serve(bus, holders_of(conference))
    await publish_revocations(bus, authority.folder, SystemClock())


def authority_beside(files: TlsFiles) -> Authority | None:
    """The authority, if its key lies beside its certificate."""
    from vistel.wire.certificates.authority import Authority
    from vistel.wire.certificates.errors import CertificateError

    try:
        return Authority(files.ca.parent) if files.ca.with_suffix(".key").exists() else None
    except CertificateError as e:
        _tell(f"{e}; certificates are not renewed here")
        return None


def asking_at(conference: Conference, place: str, endpoint: str, files: TlsFiles) -> Ask:
    """Asks the authority of this machine, or over a connection to `endpoint` that is closed again."""
    if (authority := authority_beside(files)) is not None:
        return asking_here(authority, files)

    async def ask(request: CertificateRequest) -> CertificateReply | None:
        try:
            bus = await connect(conference, place, SystemClock(), endpoint)
        except BusError:
            return None
        try:
            return await asking_on(bus, files)(request)
        finally:
            await bus.close()

    return ask


def asking_on(bus: Bus, files: TlsFiles) -> Ask:
    """Asks over a connection."""
    from vistel.wire.certificates.renewal import holder_of

    return lambda request: bus.query(BY_NAME["certificate"], request, ANSWER_S, holder=holder_of(files))


def asking_here(authority: Authority, files: TlsFiles) -> Ask:
    """Asks the authority of this machine."""
    from vistel.wire.certificates.renewal import holder_of
    from vistel.wire.certificates.signer import Signer

    signer = Signer(authority, now)

    async def ask(request: CertificateRequest) -> CertificateReply | None:
        return signer.answer(holder_of(files), request.SerializeToString())

    return ask


def holders_of(conference: Conference) -> list[str]:
    """Whoever has a certificate of the conference."""
    return [*(s.name for s in conference.sites), *conference.observers, *RESERVED]


def now() -> datetime:
    """The machine's time, by which certificates are good or not."""
    return datetime.now(UTC)


async def _keep(files: TlsFiles, ask: Ask) -> None:
    from vistel.wire.certificates.renewal import keep_renewed

    await keep_renewed(files, ask, SystemClock(), now, _tell)


def _tell(line: str) -> None:
    log.info("%s", line)
    out.print(line, soft_wrap=True)

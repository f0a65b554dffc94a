"""A certificate is renewed where it is used, in good time: with a new key, which is made here and never leaves this machine.

Zenoh closes a link when a certificate of it expires, and reads the files again when it connects again: a session that runs takes a
new certificate by itself, at the cost of one reconnection. A router reads its own when it opens, and has to be opened anew.
"""

import sys
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec

from vistel.v1.service_pb2 import CertificateReply, CertificateRequest
from vistel.whole_file import whole_file
from vistel.wire.certificates.authority import (
    CertificateError,
    common_name_of,
    key_text,
    lifetime,
    read_certificate,
    read_key,
    write_certificate,
    write_key,
)
from vistel.wire.certificates.request import certificate_request
from vistel.wire.certificates.signer import signed_by_holder
from vistel.wire.clock import Clock, sleep
from vistel.wire.zenoh.config import TlsFiles

if sys.platform != "win32":
    import fcntl

RENEWED_IN_LAST = 1 / 3
"""A certificate is renewed when this share of its lifetime is left: 30 days of 90."""
LOOK_EVERY = timedelta(hours=1)
"""How often it is looked at, and how often a host that did not answer is asked again; more often when less time is left."""
TELL_EVERY = timedelta(days=1)
"""How often it is told that it could not be renewed."""
MEND = "start vistel site router, or vistel site certs serve, where ca.key is; or get a new invitation (vistel site invite)"
"""What to do about a certificate that is not renewed."""

Ask = Callable[[CertificateRequest], Awaitable[CertificateReply | None]]
"""Asks who signs; None where nobody answers."""


def holder_of(files: TlsFiles) -> str:
    """Whose certificate it is. Raises CertificateError."""
    return common_name_of(read_certificate(files.certificate)).partition(".")[0]


def is_due(certificate: x509.Certificate, now: datetime) -> bool:
    """Whether it should be renewed."""
    return certificate.not_valid_after_utc - now < lifetime(certificate) * RENEWED_IN_LAST


def ending(files: TlsFiles, now: datetime, why: str = "") -> str:
    """When a certificate that should have been renewed ends, and what to do; empty where there is time. why: it was not renewed.
    Raises CertificateError."""
    certificate = read_certificate(files.certificate)
    if not is_due(certificate, now):
        return ""
    left = certificate.not_valid_after_utc - now
    when = f"in {left.days} days" if left.days else f"in {left.total_seconds() / 3600:.1f} hours"
    end = f"ends on {certificate.not_valid_after_utc:%Y-%m-%d %H:%M} UTC, {when}" if left > timedelta() else "has expired"
    return f"{files.certificate}: {end}, and is not renewed{f': {why}' if why else ''}; {MEND}"


async def keep_renewed(files: TlsFiles, ask: Ask, clock: Clock, now: Callable[[], datetime], tell: Callable[[str], object]) -> None:
    """Renew the certificate whenever it is due, until cancelled. tell: gets a line when it was renewed, and one a day when it could
    not be."""
    told = now() - TELL_EVERY
    while True:
        try:
            if until := await renew(files, ask, now):
                tell(f"{files.certificate}: renewed, valid until {until:%Y-%m-%d %H:%M} UTC")
        except (CertificateError, OSError) as e:
            if now() - told >= TELL_EVERY:
                told = now()
                tell(str(e) if isinstance(e, CertificateError) else ending(files, now(), f"{e.strerror or e}"))
        await sleep(clock, _until_next_look(files, now()).total_seconds())


async def renew(files: TlsFiles, ask: Ask, now: Callable[[], datetime], *, early: bool = False) -> datetime | None:
    """Renew the certificate if it is due, or `early`. Returns until when the new one is good; None where nothing was to be done, or
    another process does it. Raises CertificateError, OSError."""
    if not (early or is_due(read_certificate(files.certificate), now())):
        return None
    with _alone(files) as alone:
        if not alone:
            return None
        complete(files)
        held, held_key = read_certificate(files.certificate), read_key(files.key)
        if not (early or is_due(held, now())):
            return None
        if now() > held.not_valid_after_utc:
            raise CertificateError(ending(files, now()))
        key = ec.generate_private_key(ec.SECP256R1())
        request = certificate_request(common_name_of(held), key)
        shown = held.public_bytes(serialization.Encoding.PEM)
        reply = await ask(CertificateRequest(certificate=shown, request=request, signature=signed_by_holder(request, held_key)))
        if reply is None or reply.refused:
            why = f"the host says: {reply.refused[:200]}" if reply is not None else "nobody who signs answers"
            raise CertificateError(ending(files, now(), why) or f"{files.certificate}: is not renewed: {why}")
        _check(reply.certificate, key, held, read_certificate(files.ca))
        with whole_file(_staged(files), private=True, sync=True) as stream:
            stream.write(key_text(key) + reply.certificate)
        complete(files)
        return read_certificate(files.certificate).not_valid_after_utc


def complete(files: TlsFiles) -> None:
    """Put a new key and its certificate in their places, if they came and this was not finished. Both come in one file, so that the
    two never stay apart, whenever the machine goes down. Raises CertificateError, OSError."""
    staged = _staged(files)
    if not staged.exists():
        return
    key, certificate = read_key(staged), read_certificate(staged)
    write_key(files.key, key)
    write_certificate(files.certificate, certificate.public_bytes(serialization.Encoding.PEM))
    staged.unlink(missing_ok=True)


def _staged(files: TlsFiles) -> Path:
    return files.certificate.with_suffix(".renewed")


def _check(pem: bytes, key: ec.EllipticCurvePrivateKey, held: x509.Certificate, authority: x509.Certificate) -> None:
    """Raises CertificateError."""
    try:
        new = x509.load_pem_x509_certificate(pem)
        new.verify_directly_issued_by(authority)
        good = new.public_key() == key.public_key() and common_name_of(new) == common_name_of(held)
    except (ValueError, TypeError, InvalidSignature):
        good = False
    if not good:
        raise CertificateError("what came in place of a renewed certificate is none for this name and key, or of another authority")


@contextmanager
def _alone(files: TlsFiles) -> Generator[bool]:
    """Whether no other process of this machine renews the same certificate, until the block ends. Raises OSError."""
    with files.certificate.with_suffix(".lock").open("ab") as lock:
        if sys.platform == "win32":
            yield True
            return
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        yield True


def _until_next_look(files: TlsFiles, now: datetime) -> timedelta:
    try:
        certificate = read_certificate(files.certificate)
    except CertificateError:
        return LOOK_EVERY
    left = certificate.not_valid_after_utc - now
    if left <= timedelta():
        return LOOK_EVERY
    wait = left / 10 if is_due(certificate, now) else left - lifetime(certificate) * RENEWED_IN_LAST
    return min(max(wait, timedelta(seconds=1)), LOOK_EVERY)

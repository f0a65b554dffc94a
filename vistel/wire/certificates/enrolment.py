"""How a site gets its certificate by an invitation: over one TLS link, with one line of JSON each way.

The site makes its key, which never leaves its machine, and sends a request for a certificate with the invitation's secret. What is
on the host's side lives in memory only: when that process ends, its invitations end. It shows a certificate of its own, made at its
start, whose fingerprint is in the invitation: the site sends nothing before it has seen that one, so nobody in between learns the
secret, and the authority's certificate that comes back is the host's.
"""

import asyncio
import hashlib
import hmac
import json
import secrets
import socket
import ssl
import tempfile
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, cast

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from vistel.wire.certificates.authority import VALID, Authority, common_name_of, write_key
from vistel.wire.certificates.invitation import SECRET_BYTES, Invitation, InvitationError
from vistel.wire.certificates.request import RequestError, certificate_request, requested_key
from vistel.wire.certificates.server import ServerFiles, self_signed, server_tls

GOOD_FOR = timedelta(hours=24)
"""How long an invitation is, unless told otherwise."""
MOST_REQUEST_BYTES = 4096
"""Of what a site sends; a request of ours has 700."""
MOST_ANSWER_BYTES = 1_000_000
"""Of what comes back, the conference file with it."""
MOST_LINKS = 16
"""At a time."""
MOST_WRONG = 5
"""Attempts of one address with a wrong secret within `WRONG_COUNT_FOR`; more are not looked at."""
WRONG_COUNT_FOR = timedelta(minutes=1)
"""How long a wrong attempt counts."""
PATIENCE_S = 10.0
"""For a handshake, and for a line [s]."""


@dataclass
class _Open:
    """An invitation as its host keeps it: not the secret, but its digest."""

    digest: bytes
    until: datetime
    used: bool = False


@dataclass(frozen=True)
class Enrolled:
    """What a site has after it was enrolled; certificates as PEM."""

    key: ec.EllipticCurvePrivateKey
    certificate: bytes
    authority: bytes
    conference: str


class Enrolment:
    """The host's side. on_enrolled: called with the site and its address when it has its certificate."""

    def __init__(
        self,
        authority: Authority,
        conference: str,
        file_of: Callable[[str], str],
        now: Callable[[], datetime],
        *,
        valid: timedelta = VALID,
    ) -> None:
        """conference: its name; file_of: the text of its file that an invited site gets; valid: how long certificates are."""
        self._authority, self._conference, self._file_of, self._now, self._valid = authority, conference, file_of, now, valid
        self._open: dict[str, _Open] = {}
        self._wrong: deque[tuple[datetime, str]] = deque(maxlen=1024)
        self._links = 0
        self.on_enrolled: Callable[[str, str], None] = lambda _site, _address: None
        self._tls, self._fingerprint = _own_certificate(now())

    def invite(self, site: str, host: str, port: int, good_for: timedelta = GOOD_FOR) -> Invitation:
        """A new invitation of `site`; an earlier one of it ends. host, port: where sites find this machine."""
        secret = secrets.token_bytes(SECRET_BYTES)
        self._open[site] = _Open(hashlib.sha256(secret).digest(), self._now() + good_for)
        return Invitation(self._conference, site, host, port, self._fingerprint, secret)

    @property
    def waiting(self) -> list[str]:
        """Sites whose invitations may still be used."""
        return [site for site, o in self._open.items() if not o.used and self._now() <= o.until]

    def answer(self, line: bytes, address: str) -> bytes:
        """What a site at `address` is answered, as a line."""
        try:
            reply = self._answer(line, address)
        except (InvitationError, RequestError) as e:
            reply = {"error": str(e)}
        return json.dumps(reply).encode() + b"\n"

    async def listen(self, host: str, port: int) -> asyncio.Server:
        """Answer whoever connects to this address of this machine. Raises OSError."""
        return await asyncio.start_server(
            self._serve, host, port, ssl=self._tls, ssl_handshake_timeout=PATIENCE_S, limit=MOST_REQUEST_BYTES
        )

    def _answer(self, line: bytes, address: str) -> dict[str, str]:
        now = self._now()
        while self._wrong and now - self._wrong[0][0] > WRONG_COUNT_FOR:
            self._wrong.popleft()
        if sum(a == address for _, a in self._wrong) >= MOST_WRONG:
            raise InvitationError("too many wrong attempts from this address; wait a minute")
        try:
            site, secret, request = _request(line)
            found = self._open.get(site)
            if found is None or not hmac.compare_digest(hashlib.sha256(secret).digest(), found.digest):
                raise InvitationError("this invitation is not known; ask the host for a new one")
        except InvitationError:
            self._wrong.append((now, address))
            raise
        if found.used:
            raise InvitationError("this invitation was used already; if not by you, tell the host at once, and ask for a new one")
        if now > found.until:
            raise InvitationError("this invitation has expired; ask the host for a new one")
        key = requested_key(request.encode("utf-8", "replace"), site)
        found.used = True
        pem = self._authority.sign(site, key, now, valid=self._valid)
        self.on_enrolled(site, address)
        return {
            "certificate": pem.decode(),
            "authority": self._authority.file.read_text("ascii"),
            "conference": self._file_of(site),
        }

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._links += 1
        try:
            if self._links <= MOST_LINKS:
                async with asyncio.timeout(PATIENCE_S):
                    line = await reader.readline()
                    writer.write(self.answer(line, str(writer.get_extra_info("peername")[0])))
                    await writer.drain()
        except (OSError, ValueError, TimeoutError):  # gone, too long, too slow
            pass
        finally:
            self._links -= 1
            writer.close()


def enrol(invitation: Invitation, timeout_s: float = PATIENCE_S) -> Enrolled:
    """A new key, and its certificate from the host. Raises InvitationError."""
    key = ec.generate_private_key(ec.SECP256R1())
    request = {
        "site": invitation.site,
        "secret": invitation.secret.hex(),
        "request": certificate_request(invitation.site, key).decode(),
    }
    where = f"{invitation.host}:{invitation.port}"
    try:
        line = _exchanged(invitation, json.dumps(request).encode() + b"\n", timeout_s)
    except OSError as e:
        why = e.strerror or str(e) or "no answer"
        raise InvitationError(f"nobody answers at {where} ({why}); is the port open, and does vistel site invite run there?") from e
    reply = _strings(line)
    if reply is None or not (reply.keys() == {"error"} or reply.keys() == {"certificate", "authority", "conference"}):
        raise InvitationError(f"what answers at {where} is no host of a conference")
    if "error" in reply:
        raise InvitationError(reply["error"][:200])
    try:
        authority = x509.load_pem_x509_certificate(reply["authority"].encode())
        certificate = x509.load_pem_x509_certificate(reply["certificate"].encode())
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature) as e:
        raise InvitationError(f"the host at {where} sent a certificate that is not good") from e
    if certificate.public_key() != key.public_key() or common_name_of(certificate).split(".")[0] != invitation.site:
        raise InvitationError(f"the host at {where} sent somebody else's certificate")
    return Enrolled(key, reply["certificate"].encode(), reply["authority"].encode(), reply["conference"])


def _exchanged(invitation: Invitation, line: bytes, timeout_s: float) -> bytes:
    """The line that comes back from the machine with the invitation's fingerprint. Raises OSError, InvitationError."""
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    tls.minimum_version = ssl.TLSVersion.TLSv1_3
    tls.check_hostname, tls.verify_mode = False, ssl.CERT_NONE  # the fingerprint below decides, and no authority
    with (
        socket.create_connection((invitation.host, invitation.port), timeout_s) as plain,
        tls.wrap_socket(plain, server_hostname=invitation.host) as link,
    ):
        shown = hashlib.sha256(link.getpeercert(binary_form=True) or b"").digest()
        if not hmac.compare_digest(shown, invitation.fingerprint):
            raise InvitationError(
                f"what answers at {invitation.host}:{invitation.port} is not what invited you: the code is of an earlier start "
                "of vistel site invite, or somebody is in between; ask the host for a new one"
            )
        link.sendall(line)
        received = bytearray()
        while not received.endswith(b"\n") and len(received) <= MOST_ANSWER_BYTES:
            piece = link.recv(65536)
            if not piece:
                break
            received += piece
    return bytes(received)


def _request(line: bytes) -> tuple[str, bytes, str]:
    """The site, the secret and the request for a certificate of a line. Raises InvitationError."""
    request = _strings(line) if len(line) <= MOST_REQUEST_BYTES else None
    if request is None or request.keys() != {"site", "secret", "request"}:
        raise InvitationError("this is no request of vistel site join")
    try:
        return request["site"], bytes.fromhex(request["secret"]), request["request"]
    except ValueError as e:
        raise InvitationError("this is no request of vistel site join") from e


def _strings(line: bytes) -> dict[str, str] | None:
    """A JSON object whose values are texts."""
    try:
        value: Any = json.loads(line)
    except (ValueError, RecursionError):
        return None
    if not isinstance(value, dict):
        return None
    values = cast("dict[str, Any]", value)
    return values if all(isinstance(v, str) for v in values.values()) else None


def _own_certificate(now: datetime) -> tuple[ssl.SSLContext, bytes]:
    """TLS with a certificate that was made for this once, and its fingerprint."""
    key, certificate = self_signed("vistel site invite", now, VALID)
    with tempfile.TemporaryDirectory() as folder:  # the standard library reads keys from files only
        files = ServerFiles(Path(folder, "certificate.pem"), Path(folder, "private.key"))
        files.certificate.write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
        write_key(files.key, key)
        return server_tls(files), certificate.fingerprint(hashes.SHA256())

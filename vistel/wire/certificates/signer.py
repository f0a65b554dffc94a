"""The host's side of renewal: a new certificate for whoever shows the one that they have, and that they have its key.

The router lets everybody ask under their own name only (`vistel.wire.zenoh.access`). The request is signed with the key of the
certificate that is shown, too, so that no router in between can ask in another's name.
"""

from collections import deque
from collections.abc import Callable, Iterable
from datetime import datetime, timedelta
from functools import partial

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from google.protobuf.message import DecodeError

from vistel.v1.service_pb2 import CertificateReply, CertificateRequest
from vistel.wire.bus import Bus
from vistel.wire.certificates.authority import Authority, common_name_of, lifetime, write_certificate
from vistel.wire.certificates.request import RequestError, requested_key
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.common_names import common_name, revoked_names

MOST_BYTES = 8192
"""Of a request; one of ours has 1,300, and 30 for each address of a router."""
MOST_ASKED = 10
"""Requests of one name within `ASKED_WITHIN`; of more, none is looked at."""
ASKED_WITHIN = timedelta(hours=1)
"""How long a request counts."""
TOKEN = "signer"
"""Under which who signs is present, at the hub."""
_CONTEXT = b"vistel certificate renewal\n"
"""Stands before what is signed, so that the signature is good for nothing else."""


def signed_by_holder(request: bytes, key: ec.EllipticCurvePrivateKey) -> bytes:
    """The signature of a request with the key of the certificate that counts now."""
    return key.sign(_CONTEXT + request, ec.ECDSA(hashes.SHA256()))


class Signer:
    """Signs again, for the same name, addresses and lifetime, what the authority has signed before and has not revoked."""

    def __init__(self, authority: Authority, now: Callable[[], datetime], tell: Callable[[str], object] = lambda _: None) -> None:
        """tell: gets one line for each request that was looked at."""
        self._authority, self._now, self._tell = authority, now, tell
        self._asked: dict[str, deque[datetime]] = {}

    def serve(self, bus: Bus, holders: Iterable[str]) -> None:
        """Answer whoever asks under one of these names, and be present as who signs."""
        bus.announce(TOKEN)
        for holder in holders:
            bus.serve(BY_NAME["certificate"], partial(self.answer, holder), holder=holder)

    def answer(self, holder: str, request: bytes) -> CertificateReply:
        """What is answered to a `CertificateRequest` under the key of `holder`."""
        now = self._now()
        asked = self._asked.setdefault(holder, deque(maxlen=MOST_ASKED))
        if len(asked) == MOST_ASKED and now - asked[0] < ASKED_WITHIN:
            return CertificateReply(refused=f"{MOST_ASKED} requests within an hour; wait")
        asked.append(now)
        try:
            pem = self._signed(holder, request, now)
        except RequestError as e:
            self._tell(f"{holder}: certificate not renewed: {e}")
            return CertificateReply(refused=str(e))
        until = x509.load_pem_x509_certificate(pem).not_valid_after_utc
        self._tell(f"{holder}: certificate renewed, valid until {until:%Y-%m-%d %H:%M} UTC")
        return CertificateReply(certificate=pem)

    def _signed(self, holder: str, message: bytes, now: datetime) -> bytes:
        """Raises RequestError."""
        asked = CertificateRequest()
        try:
            asked.ParseFromString(message if len(message) <= MOST_BYTES else b"\0")
            held = x509.load_pem_x509_certificate(asked.certificate)
            hosts = _hosts(held)
            held.verify_directly_issued_by(self._authority.certificate)
            held_key = held.public_key()
            if not isinstance(held_key, ec.EllipticCurvePublicKey):
                raise RequestError("the certificate shown has no key of an elliptic curve")
            held_key.verify(asked.signature, _CONTEXT + asked.request, ec.ECDSA(hashes.SHA256()))
        except (DecodeError, ValueError, TypeError, InvalidSignature) as e:
            if isinstance(e, RequestError):
                raise
            raise RequestError("it was not asked with a certificate of this authority and its key") from e
        revoked = revoked_names(self._authority.folder)
        name = common_name_of(held)
        if name in revoked:
            raise RequestError("the certificate shown was revoked")
        if name != common_name(holder, revoked):
            raise RequestError(f"the certificate shown is not that of {holder}")
        if not held.not_valid_before_utc <= now <= held.not_valid_after_utc:
            raise RequestError("the certificate shown is not good now")
        key = requested_key(asked.request, name)
        pem = self._authority.signed(name, key, now, hosts=hosts, valid=lifetime(held))
        folder = self._authority.folder
        try:
            # A certificate whose key lies here is used here, as the hub's is by the router: it stays.
            if not (folder / f"{holder}.key").exists():
                write_certificate(folder / f"{holder}.pem", pem)
        except OSError as e:
            raise RequestError(f"{folder} cannot be written: {e.strerror or e}") from e
        return pem


def _hosts(certificate: x509.Certificate) -> list[str]:
    """The addresses at which it is a server. Raises ValueError."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [str(name.value) for name in names]

"""The authority of a conference: it signs the certificates of the hub and the sites, as files in one folder.

Keys are EC P-256. A site's certificate is good for clients only, so that no site can pose as the router.
"""

import ipaddress
import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from vistel.whole_file import whole_file
from vistel.wire.certificates.errors import CertificateError
from vistel.wire.zenoh.common_names import AUTHORITY, REVOKED, add_revoked, common_name, revoked_names
from vistel.wire.zenoh.config import TlsFiles

VALID = timedelta(days=90)
"""How long a certificate is good unless told otherwise."""
AUTHORITY_VALID = timedelta(days=3650)
"""How long an authority is."""
SLOW_CLOCK = timedelta(hours=1)
"""How far the clock of whoever sees a certificate may be behind the clock of whoever signed it."""


@dataclass(frozen=True)
class Issued:
    """A certificate in the folder. name: whose; key_here: whether its key lies there too."""

    name: str
    common_name: str
    serial: int
    from_time: datetime
    until: datetime
    revoked: bool
    key_here: bool

    def state(self, now: datetime) -> str:
        """ "valid", or why not."""
        if self.revoked:
            return "revoked"
        return "expired" if now > self.until else "not valid yet" if now < self.from_time else "valid"


class Authority:
    """Signs, and keeps what it signed."""

    def __init__(self, folder: Path) -> None:
        """Raises CertificateError where `folder` holds no authority."""
        self.folder = folder
        self.file = folder / f"{AUTHORITY}.pem"
        self.certificate = read_certificate(self.file)
        self._key = read_key(self.file.with_suffix(".key"))

    @staticmethod
    def create(folder: Path, now: datetime, name: str = "vistel authority") -> "Authority":
        """A new authority. What `folder` holds of another one counts no more. Raises OSError."""
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        key = ec.generate_private_key(ec.SECP256R1())
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        usage = x509.KeyUsage(False, False, False, False, False, True, True, False, False)
        certificate = (
            builder_of(subject, subject, key.public_key(), now, AUTHORITY_VALID)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(usage, critical=True)
            .sign(key, hashes.SHA256())
        )
        write_key(folder / f"{AUTHORITY}.key", key)
        _write(folder / f"{AUTHORITY}.pem", certificate.public_bytes(serialization.Encoding.PEM))
        (folder / REVOKED).unlink(missing_ok=True)
        return Authority(folder)

    def issue(self, name: str, now: datetime, *, hosts: Sequence[str] = (), valid: timedelta = VALID) -> TlsFiles:
        """A new key and its certificate for `name`. hosts: addresses at which it is a server. Raises OSError."""
        key = ec.generate_private_key(ec.SECP256R1())
        write_key(self.folder / f"{name}.key", key)
        self.sign(name, key.public_key(), now, hosts=hosts, valid=valid)
        return files_of(self.folder, name)

    def sign(
        self, name: str, key: ec.EllipticCurvePublicKey, now: datetime, *, hosts: Sequence[str] = (), valid: timedelta = VALID
    ) -> bytes:
        """A certificate (PEM) for somebody else's key; kept in the folder. Raises OSError."""
        pem = self.signed(common_name(name, revoked_names(self.folder)), key, now, hosts=hosts, valid=valid)
        write_certificate(self.folder / f"{name}.pem", pem)
        return pem

    def signed(
        self, name: str, key: ec.EllipticCurvePublicKey, now: datetime, *, hosts: Sequence[str] = (), valid: timedelta = VALID
    ) -> bytes:
        """A certificate (PEM) with this common name, which is kept nowhere."""
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        uses = [ExtendedKeyUsageOID.CLIENT_AUTH, *([ExtendedKeyUsageOID.SERVER_AUTH] if hosts else [])]
        builder = (
            builder_of(subject, self.certificate.subject, key, now, valid)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(x509.ExtendedKeyUsage(uses), critical=True)
        )
        if hosts:
            builder = builder.add_extension(x509.SubjectAlternativeName([general_name(h) for h in hosts]), critical=False)
        return builder.sign(self._key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)

    def revoke(self, name: str) -> str:
        """Its certificates count no more, once routers have read the list. Returns their common name. Raises OSError."""
        gone = common_name(name, revoked_names(self.folder))
        add_revoked(self.folder, [gone])
        return gone

    def issued(self) -> list[Issued]:
        """The newest certificate of everybody, in the order of the names. Raises CertificateError."""
        revoked, found = revoked_names(self.folder), list[Issued]()
        for path in sorted(self.folder.glob("*.pem")):
            certificate = read_certificate(path)
            name, here = common_name_of(certificate), path.with_suffix(".key").exists()
            times = certificate.not_valid_before_utc, certificate.not_valid_after_utc
            found.append(Issued(path.stem, name, certificate.serial_number, *times, name in revoked, here))
        return found


def files_of(folder: Path, name: str) -> TlsFiles:
    """Where the certificate and key of `name` lie."""
    return TlsFiles(folder / f"{AUTHORITY}.pem", folder / f"{name}.pem", folder / f"{name}.key")


def lifetime(certificate: x509.Certificate) -> timedelta:
    """How long it is good from its signature on."""
    return certificate.not_valid_after_utc - certificate.not_valid_before_utc - SLOW_CLOCK


def fault(files: TlsFiles, now: datetime) -> str:
    """Why these files are not good now, in one line; empty where they are."""
    try:
        authority, certificate, key = read_certificate(files.ca), read_certificate(files.certificate), read_key(files.key)
    except CertificateError as e:
        return str(e)
    until, begin = certificate.not_valid_after_utc, certificate.not_valid_before_utc
    if key.public_key() != certificate.public_key():
        return f"{files.key}: is not the key of {files.certificate}"
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature):
        return f"{files.certificate}: is not of the authority {files.ca}"
    if now > until:
        return f"{files.certificate}: expired on {until:%Y-%m-%d %H:%M} UTC; the host renews it, or sends a new invitation"
    if now < begin:
        return (
            f"{files.certificate}: is good from {begin:%Y-%m-%d %H:%M} UTC on, and this machine's clock says {now:%Y-%m-%d %H:%M}"
        )
    return ""


def common_name_of(certificate: x509.Certificate) -> str:
    """Empty where it has none."""
    found = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(found[0].value) if found else ""


def read_certificate(path: Path) -> x509.Certificate:
    """Raises CertificateError."""
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except OSError as e:
        raise CertificateError(f"{path}: {e.strerror or e}") from e
    except ValueError as e:
        raise CertificateError(f"{path}: is no certificate (PEM)") from e


def read_key(path: Path) -> ec.EllipticCurvePrivateKey:
    """Raises CertificateError, also where others than its owner may read it."""
    try:
        if os.name == "posix" and path.stat().st_mode & 0o077:
            raise CertificateError(f"{path}: others may read this key; chmod 600 {path}")
        key = serialization.load_pem_private_key(path.read_bytes(), None)
    except OSError as e:
        raise CertificateError(f"{path}: {e.strerror or e}") from e
    except (ValueError, TypeError) as e:
        if isinstance(e, CertificateError):
            raise
        raise CertificateError(f"{path}: is no private key (PEM, without a password)") from e
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise CertificateError(f"{path}: is no key of an elliptic curve")
    return key


def write_key(path: Path, key: ec.EllipticCurvePrivateKey) -> None:
    """Only its owner may read the file. Raises OSError."""
    _write(path, key_text(key), private=True)


def key_text(key: ec.EllipticCurvePrivateKey) -> bytes:
    """The key as PEM, without a password."""
    return key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())


def write_certificate(path: Path, pem: bytes) -> None:
    """Raises OSError."""
    _write(path, pem)


def _write(path: Path, content: bytes, *, private: bool = False) -> None:
    with whole_file(path, private=private, sync=True) as stream:
        stream.write(content)


def builder_of(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePublicKey, now: datetime, valid: timedelta
) -> x509.CertificateBuilder:
    """What every certificate has: whose, of whom, which key, and how long from now."""
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - SLOW_CLOCK)
        .not_valid_after(now + valid)
    )


def general_name(host: str) -> x509.GeneralName:
    """An address or a name, as certificates say it."""
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)

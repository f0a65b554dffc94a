"""Certificates of servers for people: one that is named, or one of the server's own. That one no authority has signed, so people
compare its fingerprint."""

import ssl
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from vistel.whole_file import whole_file
from vistel.wire.certificates.authority import builder_of, general_name, read_certificate
from vistel.wire.certificates.errors import CertificateError

OWN_VALID = timedelta(days=397)
"""How long a server's own certificate is good: browsers take no longer ones."""
RENEWED_BEFORE = timedelta(days=30)
"""Of its end, the next one is made: fingerprints should not change during a conference."""


@dataclass(frozen=True)
class ServerFiles:
    """Paths of what a server shows (PEM): its certificate, perhaps with those up to an authority, and the key of that."""

    certificate: Path
    key: Path


def self_signed(
    name: str, now: datetime, valid: timedelta, hosts: Sequence[str] = ()
) -> tuple[ec.EllipticCurvePrivateKey, x509.Certificate]:
    """A new key and its certificate, which has this common name and is good for a server at `hosts`."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    builder = (
        builder_of(subject, subject, key.public_key(), now, valid)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=True)
    )
    if hosts:
        builder = builder.add_extension(x509.SubjectAlternativeName([general_name(h) for h in hosts]), critical=False)
    return key, builder.sign(key, hashes.SHA256())


def own_certificate(folder: Path, name: str, hosts: Sequence[str], now: datetime) -> ServerFiles:
    """The certificate `name` of this machine, the same at every start until it is renewed; both parts are in one file that only its
    owner may read. Raises OSError."""
    path = folder / f"{name}.pem"
    try:
        found = read_certificate(path)
        server_tls(ServerFiles(path, path))
        if path.stat().st_mode & 0o077 == 0 and found.not_valid_before_utc <= now <= found.not_valid_after_utc - RENEWED_BEFORE:
            return ServerFiles(path, path)
    except (CertificateError, FileNotFoundError):
        pass
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    key, certificate = self_signed(f"vistel {name}", now, OWN_VALID, hosts)
    plain = serialization.NoEncryption()
    with whole_file(path, private=True) as stream:
        stream.write(key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, plain))
        stream.write(certificate.public_bytes(serialization.Encoding.PEM))
    return ServerFiles(path, path)


def server_tls(files: ServerFiles) -> ssl.SSLContext:
    """TLS 1.3 with this certificate. Raises CertificateError."""
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.minimum_version = ssl.TLSVersion.TLSv1_3
    try:
        tls.load_cert_chain(files.certificate, files.key, password=lambda: "")  # else a key with one asks at the terminal
    except FileNotFoundError as e:
        missing = next((f for f in (files.certificate, files.key) if not f.exists()), files.certificate)
        raise CertificateError(f"{missing}: {e.strerror}") from e
    except (ssl.SSLError, ValueError) as e:
        raise CertificateError(f"{files.key}: is not the key of {files.certificate} (PEM, without a password)") from e
    except OSError as e:
        raise CertificateError(f"{files.certificate}, {files.key}: {e.strerror or e}") from e
    return tls


def fingerprint(certificate: x509.Certificate) -> str:
    """SHA-256 as browsers show it."""
    return certificate.fingerprint(hashes.SHA256()).hex(":").upper()


def names_of(certificate: x509.Certificate) -> frozenset[str]:
    """The DNS names that it is good for, in lower case; "*.example.org" stands for one label."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return frozenset()
    return frozenset(name.lower() for name in names.get_values_for_type(x509.DNSName))

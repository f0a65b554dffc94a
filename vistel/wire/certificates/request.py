"""Requests for certificates (PKCS #10): whoever asks makes the key, and what is sent shows that they have it."""

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID


class RequestError(ValueError):
    """A request for a certificate that is refused; the text says why."""


def certificate_request(name: str, key: ec.EllipticCurvePrivateKey) -> bytes:
    """A request (PEM) of `name` for a certificate of `key`."""
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    request = x509.CertificateSigningRequestBuilder().subject_name(subject).sign(key, hashes.SHA256())
    return request.public_bytes(serialization.Encoding.PEM)


def requested_key(request: bytes, name: str) -> ec.EllipticCurvePublicKey:
    """The key of a request that its owner has signed; of all else in it, nothing is taken. Raises RequestError."""
    try:
        read = x509.load_pem_x509_csr(request)
        key, signed = read.public_key(), read.is_signature_valid
        names = [str(a.value) for a in read.subject]
    except (ValueError, TypeError) as e:
        raise RequestError("the request for a certificate cannot be read") from e
    if not (signed and isinstance(key, ec.EllipticCurvePublicKey) and isinstance(key.curve, ec.SECP256R1) and names == [name]):
        raise RequestError(f"the request for a certificate is not of {name}, or its key is not EC P-256")
    return key

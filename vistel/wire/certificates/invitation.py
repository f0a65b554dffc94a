"""An invitation: one line that the host prints and a site pastes, and that is worth one certificate."""

import base64
import binascii
import re
from dataclasses import dataclass

SECRET_BYTES = 16
"""Too many to guess."""
FINGERPRINT_BYTES = 32
"""Of SHA-256."""
_NAME = r"[a-z0-9][a-z0-9_\-]{0,31}"
_CODE = re.compile(rf"({_NAME})/({_NAME})@([0-9A-Za-z.\-_]{{1,253}}|\[[0-9a-fA-F:.]{{2,45}}\]):(\d{{1,5}})/([A-Za-z0-9_\-]{{64}})")


class InvitationError(ValueError):
    """A code that is none, or an invitation that gives no certificate; the text says why, and what to do."""


@dataclass(frozen=True)
class Invitation:
    """conference, site: who is invited; host, port: where; fingerprint: SHA-256 of the certificate that is shown there, by which
    nobody else can answer; secret: what the site shows."""

    conference: str
    site: str
    host: str
    port: int
    fingerprint: bytes
    secret: bytes

    @property
    def code(self) -> str:
        """In one line, without a space."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        token = base64.urlsafe_b64encode(self.fingerprint + self.secret).decode()
        return f"{self.conference}/{self.site}@{host}:{self.port}/{token}"

    @staticmethod
    def read(code: str) -> "Invitation":
        """Raises InvitationError."""
        found = _CODE.fullmatch(code.strip())
        try:
            token = base64.b64decode(found[5], altchars=b"-_", validate=True) if found else b""
        except binascii.Error:
            token = b""
        if found is None or len(token) != FINGERPRINT_BYTES + SECRET_BYTES or not 0 < int(found[4]) < 65536:
            raise InvitationError("the invitation is not whole: paste the line that vistel site invite printed, from end to end")
        return Invitation(
            found[1], found[2], found[3].strip("[]"), int(found[4]), token[:FINGERPRINT_BYTES], token[FINGERPRINT_BYTES:]
        )

"""Somebody wants a certificate that was meant for somebody else. What it needs: to reach the host's port."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import io
import json
import socket
import ssl
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import typer
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.x509.oid import NameOID
from hypothesis import given
from hypothesis import strategies as st

from vistel.conference.connect import tls_files
from vistel.conference.files import load
from vistel.wire.certificates.authority import Authority, fault
from vistel.wire.certificates.enrolment import MOST_ANSWER_BYTES, MOST_REQUEST_BYTES, MOST_WRONG, Enrolment, enrol
from vistel.wire.certificates.invitation import Invitation, InvitationError
from vistel_cli.site.invite import _folder_name, accept

START = datetime(2026, 5, 1, tzinfo=UTC)
FILE = 'name = "demo"\n'


class Host:
    """An open invitation of tokyo, and a clock."""

    def __init__(self, folder: Path) -> None:
        self.now = START
        self.authority = Authority.create(folder, START)
        self.enrolment = Enrolment(self.authority, "demo", lambda _site: FILE, lambda: self.now)
        self.invitation = self.enrolment.invite("tokyo", "127.0.0.1", 7448)

    def asked(self, site: str = "tokyo", *, secret: bytes | None = None, request: str | None = None, address: str = "a") -> str:
        """The error, or "" where a certificate came."""
        secret = self.invitation.secret if secret is None else secret
        said = {"site": site, "secret": secret.hex(), "request": request_of("tokyo") if request is None else request}
        return str(json.loads(self.enrolment.answer(json.dumps(said).encode(), address)).get("error", ""))


def request_of(name: str, key: ec.EllipticCurvePrivateKey | rsa.RSAPrivateKey | None = None) -> str:
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    made = x509.CertificateSigningRequestBuilder().subject_name(subject)
    signed = made.sign(key or ec.generate_private_key(ec.SECP256R1()), hashes.SHA256())
    return signed.public_bytes(serialization.Encoding.PEM).decode()


@pytest.fixture
def host(tmp_path: Path) -> Host:
    return Host(tmp_path / "certificates")


def test_a_wrong_secret_gets_no_certificate_and_few_attempts_of_an_address_are_looked_at(host: Host) -> None:
    for _ in range(MOST_WRONG):
        assert "not known" in host.asked(secret=bytes(16))
    assert "too many" in host.asked(), "nor with the right one, for a while"
    assert host.asked(address="b") == "", "others are not kept out"
    host.now += timedelta(minutes=2)
    assert "used already" in host.asked()


def test_an_invitation_is_good_once(host: Host) -> None:
    assert host.asked() == ""
    assert "used already" in host.asked()
    assert host.enrolment.waiting == []


def test_an_invitation_expires(host: Host) -> None:
    host.now += timedelta(hours=24, seconds=1)
    assert "has expired" in host.asked()


def test_an_earlier_invitation_of_a_site_ends_with_the_next(host: Host) -> None:
    host.enrolment.invite("tokyo", "127.0.0.1", 7448)
    assert "not known" in host.asked()


def test_an_invitation_is_good_for_its_site_only(host: Host) -> None:
    assert "not known" in host.asked(site="paris")
    host.enrolment.invite("paris", "127.0.0.1", 7448)
    assert "not known" in host.asked(site="paris"), "nor for another that is invited too"
    assert "not of tokyo" in host.asked(request=request_of("hub"))
    assert host.asked(address="b") == "", "a request that was refused uses nothing up"


def test_only_a_signed_request_of_an_elliptic_key_is_taken_and_only_its_key(host: Host) -> None:
    assert "EC P-256" in host.asked(request=request_of("tokyo", rsa.generate_private_key(65537, 2048)))
    assert "EC P-256" in host.asked(request=request_of("tokyo", ec.generate_private_key(ec.SECP384R1())))
    assert "cannot be read" in host.asked(request="-----BEGIN CERTIFICATE REQUEST-----\nAAAA\n-----END CERTIFICATE REQUEST-----\n")
    assert "cannot be read" in host.asked(request="\ud800")


@given(st.binary(max_size=200) | st.recursive(st.text() | st.integers(), lambda j: st.dictionaries(st.text(), j)).map(json.dumps))
def test_no_bytes_at_all_are_more_than_refused(tmp_path_factory: pytest.TempPathFactory, line: bytes | str) -> None:
    host = Host(tmp_path_factory.mktemp("fuzz"))
    said = host.enrolment.answer(line.encode() if isinstance(line, str) else line, "a")
    assert json.loads(said).keys() == {"error"}


def live(host: Host, attack: object) -> None:
    """Run `attack`, a function of an invitation with the true port, while the host answers."""

    async def run() -> None:
        server = await host.enrolment.listen("127.0.0.1", 0)
        invitation = dataclasses.replace(host.invitation, port=server.sockets[0].getsockname()[1])
        try:
            await asyncio.to_thread(attack, invitation)  # type: ignore[arg-type]
        finally:
            server.close()

    asyncio.run(run())


def test_a_site_is_enrolled_over_a_link_and_its_key_stays_with_it(host: Host) -> None:
    def play(invitation: Invitation) -> None:
        got = enrol(Invitation.read(invitation.code))
        certificate = x509.load_pem_x509_certificate(got.certificate)
        certificate.verify_directly_issued_by(host.authority.certificate)
        assert certificate.public_key() == got.key.public_key()
        assert got.conference == FILE and got.authority == host.authority.file.read_bytes()
        assert (host.authority.folder / "tokyo.pem").read_bytes() == got.certificate
        assert not (host.authority.folder / "tokyo.key").exists()
        with pytest.raises(InvitationError, match="used already"):
            enrol(invitation)

    live(host, play)


def test_a_machine_in_between_is_known_by_its_fingerprint_and_learns_no_secret(host: Host) -> None:
    other = Enrolment(host.authority, "demo", lambda _site: FILE, lambda: START)
    heard: list[bytes] = []
    other.answer = lambda line, address: heard.append(line) or b"{}\n"  # type: ignore[method-assign]

    async def run() -> None:
        server = await other.listen("127.0.0.1", 0)
        invitation = dataclasses.replace(host.invitation, port=server.sockets[0].getsockname()[1])
        with pytest.raises(InvitationError, match="somebody is in between"):
            await asyncio.to_thread(enrol, invitation)
        server.close()

    asyncio.run(run())
    assert b"".join(heard) == b""
    assert host.enrolment.waiting == ["tokyo"]


def test_more_than_a_request_has_is_not_read(host: Host) -> None:
    def play(invitation: Invitation) -> None:
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        tls.check_hostname, tls.verify_mode = False, ssl.CERT_NONE
        with socket.create_connection(("127.0.0.1", invitation.port), 10) as plain, tls.wrap_socket(plain) as link:
            try:
                for _ in range(100):
                    link.sendall(b"x" * MOST_REQUEST_BYTES)
                assert link.recv(100) == b""
            except OSError:
                pass  # the link was closed while it was written to
        assert enrol(invitation).conference == FILE, "and others are answered"

    live(host, play)


def test_a_code_that_is_not_whole_is_told(host: Host) -> None:
    code = host.invitation.code
    for broken in ("", code[:-1], code + "A", code.replace(":", ":9", 1), code.replace("/", " ", 1)):
        with pytest.raises(InvitationError, match="not whole"):
            Invitation.read(broken)


def test_no_line_that_the_host_or_the_site_is_told_holds_the_secret(host: Host, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("DEBUG")
    shown = [bytes([n]) * len(host.invitation.secret) for n in range(MOST_WRONG + 1)]
    told = [host.asked(secret=s) for s in shown] + [host.asked(address="b"), host.asked(address="b")]
    assert all(told[: len(shown)]) and told[-1]

    def play(invitation: Invitation) -> None:
        for wrong in (invitation, dataclasses.replace(invitation, secret=shown[0])):
            with pytest.raises(InvitationError) as refused:
                enrol(wrong)
            told.append(str(refused.value))

    live(host, play)
    lines = [*told, *(r.getMessage() for r in caplog.records)]
    for secret in (host.invitation.secret, *shown):
        assert not any(secret.hex() in line or Invitation.read(host.invitation.code).code in line for line in lines)


def test_what_a_host_sends_a_site_is_no_more_than_a_conference_takes(host: Host) -> None:
    """What it needs: to be the host that somebody was invited by."""

    async def run() -> None:
        sent = 0

        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            nonlocal sent
            await reader.readline()
            with contextlib.suppress(OSError):
                while not writer.is_closing():
                    writer.write(b"x" * 65_536)
                    await writer.drain()
                    await asyncio.sleep(0)
                    sent += 65_536

        server = await asyncio.start_server(answer, "127.0.0.1", 0, ssl=host.enrolment._tls)
        with pytest.raises(InvitationError, match="is no host of a conference"):
            await asyncio.to_thread(enrol, dataclasses.replace(host.invitation, port=server.sockets[0].getsockname()[1]))
        assert sent < 64 * MOST_ANSWER_BYTES
        server.close()

    asyncio.run(run())


def test_an_invitation_of_nobody_is_told(host: Host) -> None:
    with pytest.raises(InvitationError, match="nobody answers"):
        enrol(dataclasses.replace(host.invitation, port=9))


def test_what_an_invitation_brings_is_kept_in_a_folder_and_nothing_is_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "conference.toml"
    file.write_text(
        'name = "office"\n[bus]\nmode = "routed"\nendpoints = ["tls/127.0.0.1:7447"]\ntls = { folder = "certificates" }\n'
        '[console]\nat = "0.0.0.0:8440"\ntoken = "of-the-console-alone"\n'
        '[[sites]]\nname = "tokyo"\nparticipants = [{ name = "ann" }]\n'
        'display = { width = 640, stream = "0.0.0.0:8090", stream_token = "of-tokyo-and-alone" }\n'
        '[[sites]]\nname = "osaka"\nparticipants = [{ name = "ben" }]\n'
        'display = { width = 480, stream = "0.0.0.0:8090", stream_token = "of-osaka-and-alone" }\n'
    )
    Authority.create(tmp_path / "certificates", datetime.now(UTC))
    words = [sys.executable, "-m", "vistel_cli.main", "site", "invite", str(file), "tokyo", "--port", "0"]
    host = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert host.stdout is not None
    code = next(line for line in host.stdout if line.startswith("    "))
    there = tmp_path / "there"
    there.mkdir()
    monkeypatch.chdir(there)
    monkeypatch.setattr("sys.stdin", io.StringIO(code))
    kept, site = accept("-", force=False)
    assert (str(kept), site) == ("office/conference.toml", "tokyo")
    keys = list(kept.parent.rglob("*.key"))
    assert keys and all(key.stat().st_mode & 0o077 == 0 for key in keys), "nobody else of the machine reads the key"
    files = tls_files(load(kept), "tokyo")
    assert files is not None and fault(files, datetime.now(UTC)) == ""
    text = kept.read_text()
    assert "of-tokyo-and-alone" in text and "of-osaka-and-alone" not in text and "of-the-console-alone" not in text
    assert [s.display.width for s in load(kept).sites] == [640, 480], "all else is there"
    assert not (tmp_path / "certificates/tokyo.key").exists(), "the key stays where it was made"
    assert host.wait() == 0
    before = kept.read_bytes()
    for again, why in ((False, "exists already"), (True, "nobody answers")):
        with pytest.raises(typer.Exit):
            accept(code, force=again)
        assert why in capsys.readouterr().err
    assert kept.read_bytes() == before


@pytest.mark.parametrize("folder", ['"/etc"', '".."', '"a/b"', '"."', '""', "1", '"a\\u0000b"', None])
def test_a_conference_file_from_elsewhere_is_not_kept_outside_its_folder(folder: str | None) -> None:
    text = "[bus]\n" if folder is None else f"[bus.tls]\nfolder = {folder}\n"
    assert _folder_name(text) == ""
    assert _folder_name('[bus.tls]\nfolder = "certificates"\n') == "certificates"

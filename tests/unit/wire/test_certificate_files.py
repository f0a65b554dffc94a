"""Certificates as files: what is refused, and why."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from vistel.wire.certificates.authority import Authority, fault
from vistel.wire.certificates.errors import CertificateError
from vistel.wire.zenoh.common_names import common_name, revoked_names
from vistel.wire.zenoh.config import TlsFiles
from vistel.wire.zenoh.endpoints import host_and_port, objection

NOW = datetime(2026, 5, 1, tzinfo=UTC)


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority.create(tmp_path / "certificates", NOW)


def test_a_certificate_is_good_with_its_own_key_and_authority_until_it_expires(authority: Authority, tmp_path: Path) -> None:
    tokyo, paris = authority.issue("tokyo", NOW), authority.issue("paris", NOW)
    other = Authority.create(tmp_path / "other", NOW)
    assert fault(tokyo, NOW) == ""
    assert fault(tokyo, NOW - timedelta(minutes=59)) == "", "a clock may be an hour behind"
    assert "expired on 2026-07-30" in fault(tokyo, NOW + timedelta(days=91))
    assert "good from 2026-04-30 23:00 UTC on, and this machine's clock says 2026-04-01 00:00" in fault(
        tokyo, NOW - timedelta(days=30)
    )
    assert "is not the key of" in fault(TlsFiles(tokyo.ca, tokyo.certificate, paris.key), NOW)
    assert "is not of the authority" in fault(TlsFiles(other.file, tokyo.certificate, tokyo.key), NOW)


@pytest.mark.parametrize("which", ["ca", "certificate", "key"])
@pytest.mark.parametrize("content", [None, b"", b"\0\xff", b"-----BEGIN CERTIFICATE-----\n????\n-----END CERTIFICATE-----\n"])
def test_a_file_that_is_missing_or_garbage_is_named(authority: Authority, which: str, content: bytes | None) -> None:
    files = authority.issue("tokyo", NOW)
    path: Path = getattr(files, which)
    path.unlink()
    if content is not None:
        path.write_bytes(content)
        path.chmod(0o600)
    assert fault(files, NOW).startswith(f"{path}: ")


def test_keys_are_their_owners_alone_and_others_are_refused(authority: Authority) -> None:
    files = authority.issue("tokyo", NOW)
    assert {p.stat().st_mode & 0o777 for p in authority.folder.glob("*.key")} == {0o600}
    assert authority.folder.stat().st_mode & 0o777 == 0o700
    files.key.chmod(0o640)
    assert "chmod 600" in fault(files, NOW)


def test_what_is_revoked_is_followed_by_another_common_name(authority: Authority) -> None:
    authority.issue("tokyo", NOW)
    assert authority.revoke("tokyo") == "tokyo"
    assert [(i.name, i.state(NOW)) for i in authority.issued()] == [("ca", "valid"), ("tokyo", "revoked")]
    authority.issue("tokyo", NOW)
    assert [i.common_name for i in authority.issued()] == ["vistel authority", "tokyo.2"]
    assert authority.revoke("tokyo") == "tokyo.2"
    assert revoked_names(authority.folder) == ["tokyo", "tokyo.2"]
    assert common_name("tokyo", revoked_names(authority.folder)) == "tokyo.3"


def test_an_authority_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(CertificateError, match=r"ca\.pem: No such file"):
        Authority(tmp_path)


@pytest.mark.parametrize(
    ("endpoint", "tls", "insecure", "why"),
    [
        ("tls/192.0.2.7:7447", True, False, ""),
        ("tls/192.0.2.7:7447", False, True, "needs certificates"),
        ("tcp/127.0.0.1:7447", False, False, ""),
        ("tcp/[::1]:7447", False, False, ""),
        ("tcp/localhost", False, False, ""),
        ("tcp/127.0.0.1:7447", True, True, "is not encrypted"),
        ("tcp/0.0.0.0:7447", False, False, "anybody"),
        ("tcp/localhost.example.org:7447", False, False, "anybody"),
        ("udp/[::]:7447", False, False, "anybody"),
        ("tcp/192.0.2.7:7447", False, True, ""),
        ("nonsense", False, False, "expected tcp/HOST:PORT"),
    ],
)
def test_plain_links_beyond_this_machine_need_to_be_meant(endpoint: str, tls: bool, insecure: bool, why: str) -> None:
    found = objection(endpoint, tls=tls, insecure=insecure)
    assert why in found and bool(found) == bool(why)


def test_host_and_port_of_endpoints() -> None:
    assert host_and_port("tls/hub.example.org") == ("hub.example.org", 7447)
    assert host_and_port("tcp/[2001:db8::1]:7500#iface=eth0") == ("2001:db8::1", 7500)

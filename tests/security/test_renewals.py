"""Somebody wants a certificate by renewal that is not theirs, or no more. What it needs: a certificate of the conference."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec
from hypothesis import given
from hypothesis import strategies as st
from secured_bus import Secured, secured
from waiting import until

from vistel.v1.service_pb2 import CertificateReply, CertificateRequest, Revocations
from vistel.wire.certificates.authority import Authority, common_name_of, read_certificate, read_key
from vistel.wire.certificates.request import certificate_request
from vistel.wire.certificates.revocations import follow_revocations
from vistel.wire.certificates.signer import ASKED_WITHIN, MOST_ASKED, Signer, signed_by_holder
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.common_names import revoked_names
from vistel.wire.zenoh.config import TlsFiles

START = datetime(2026, 5, 1, tzinfo=UTC)


class Host:
    """An authority that signs, and a clock."""

    def __init__(self, folder: Path) -> None:
        self.now = START
        self.authority = Authority.create(folder, START)
        self.said: list[str] = []
        self.signer = Signer(self.authority, lambda: self.now, self.said.append)

    def asked(self, holder: str, request: CertificateRequest) -> str:
        """Why there is no certificate; empty where there is one."""
        return self.signer.answer(holder, request.SerializeToString()).refused


def request_of(files: TlsFiles, name: str = "", key: ec.EllipticCurvePrivateKey | None = None) -> CertificateRequest:
    """As a site makes it; for another name, or signed with another key, if they are given."""
    held = read_certificate(files.certificate)
    request = certificate_request(name or common_name_of(held), ec.generate_private_key(ec.SECP256R1()))
    signature = signed_by_holder(request, key or read_key(files.key))
    return CertificateRequest(certificate=held.public_bytes(serialization.Encoding.PEM), request=request, signature=signature)


@pytest.fixture
def host(tmp_path: Path) -> Host:
    return Host(tmp_path / "certificates")


def test_nobody_gets_a_certificate_for_another_name(host: Host) -> None:
    paris, tokyo = host.authority.issue("paris", START), host.authority.issue("tokyo", START)
    assert "not that of tokyo" in host.asked("tokyo", request_of(paris))
    assert "not that of tokyo" in host.asked("tokyo", request_of(paris, "tokyo"))
    assert "not of paris" in host.asked("paris", request_of(paris, "tokyo"))
    assert "not of paris" in host.asked("paris", request_of(paris, "hub"))
    assert "not that of hub" in host.asked("hub", request_of(paris))
    assert "its key" in host.asked("tokyo", request_of(tokyo, key=read_key(paris.key))), "a certificate is no secret, its key is"
    assert host.asked("tokyo", request_of(tokyo)) == ""


def test_a_request_that_was_heard_is_worth_nothing_with_another_key_in_it(host: Host) -> None:
    heard, mine = request_of(host.authority.issue("tokyo", START)), request_of(host.authority.issue("paris", START), "tokyo")
    forged = CertificateRequest(certificate=heard.certificate, request=mine.request, signature=heard.signature)
    assert "its key" in host.asked("tokyo", forged)


def test_a_revoked_certificate_is_not_renewed_and_neither_is_one_that_has_ended(host: Host) -> None:
    old = host.authority.issue("tokyo", START)
    request = request_of(old)
    host.authority.revoke("tokyo")
    assert "was revoked" in host.asked("tokyo", request)
    new = host.authority.issue("tokyo", START)
    assert "was revoked" in host.asked("tokyo", request), "nor when the site has another one"
    assert host.asked("tokyo", request_of(new)) == ""
    host.now += timedelta(days=91)
    assert "not good now" in host.asked("tokyo", request_of(new))


def test_another_authority_and_a_client_that_would_be_a_server_get_nothing(host: Host, tmp_path: Path) -> None:
    other = Authority.create(tmp_path / "other", START)
    assert "of this authority" in host.asked("tokyo", request_of(other.issue("tokyo", START)))
    reply = host.signer.answer("tokyo", request_of(host.authority.issue("tokyo", START)).SerializeToString())
    uses = x509.load_pem_x509_certificate(reply.certificate).extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    assert list(uses) == [x509.oid.ExtendedKeyUsageOID.CLIENT_AUTH]


def test_a_flood_of_requests_of_one_name_is_a_few_an_hour_and_keeps_nobody_else_out(host: Host) -> None:
    paris, tokyo = host.authority.issue("paris", START), host.authority.issue("tokyo", START)
    for _ in range(200):
        host.asked("paris", request_of(paris))
    assert len(host.said) == MOST_ASKED
    assert "within an hour" in host.asked("paris", request_of(paris))
    assert host.asked("tokyo", request_of(tokyo)) == ""
    host.now += ASKED_WITHIN
    assert host.asked("paris", request_of(paris)) == ""


@given(st.binary(max_size=300) | st.binary(max_size=9000).map(lambda b: CertificateRequest(certificate=b).SerializeToString()))
def test_no_bytes_at_all_get_more_than_a_refusal(tmp_path_factory: pytest.TempPathFactory, message: bytes) -> None:
    reply = Host(tmp_path_factory.mktemp("fuzz")).signer.answer("tokyo", message)
    assert reply.refused and not reply.certificate


@pytest.mark.parametrize("all_may_ask", [True, False], ids=["before", "now"])
@pytest.mark.parametrize("protocol", ["tls", "quic"])
def test_each_asks_under_its_own_name_only_an_observer_too(tmp_path: Path, protocol: str, all_may_ask: bool) -> None:
    async def body(s: Secured) -> None:
        hub = await s.door("hub")
        topic = BY_NAME["certificate"]
        for name in ("tokyo", "paris", "guest", "hub"):
            hub.serve(topic, lambda _: CertificateReply(refused="asked"), holder=name)
        for name in ("tokyo", "paris", "guest"):
            bus = await s.door(name)
            while await bus.query(topic, timeout_s=0.5, holder=name) is None:  # until the router knows who answers
                pass
        for attacker, name in (("paris", "tokyo"), ("paris", "hub"), ("guest", "paris"), ("world", "hub")):
            bus, session = await s.door(attacker), s.session(attacker)
            got: list[bool] = []
            while not got or (all_may_ask and not any(got)):  # a busy machine may take longer to answer
                got += [await bus.query(topic, timeout_s=0.5, holder=name) is not None]
                for key in ("vistel/demo/certificate/*", "vistel/demo/**"):
                    replies = [str(r.ok.key_expr) for r in session.get(key, timeout=0.5) if r.ok is not None]
                    got.append(topic.format(conference="demo", holder=name) in replies)
            assert any(got) == all_may_ask, (attacker, name, got)

    secured(tmp_path, body, protocol=protocol, all_may_ask=all_may_ask)


@pytest.mark.parametrize("attacker", ["paris", "guest", "world"])
def test_nobody_but_the_hub_answers_who_renews_or_tells_what_was_revoked(tmp_path: Path, attacker: str) -> None:
    async def body(s: Secured) -> None:
        hub, tokyo, false = await s.door("hub"), await s.door("tokyo"), await s.door(attacker)
        false.serve(BY_NAME["certificate"], lambda _: CertificateReply(refused="false"), holder="tokyo")
        assert await tokyo.query(BY_NAME["certificate"], timeout_s=0.5, holder="tokyo") is None
        heard = hub.subscribe(BY_NAME["revocations"], polled=True)
        false.publish(BY_NAME["revocations"]).put(Revocations(names=["tokyo"]))
        got: list[list[str]] = []
        true = (await s.door("hub")).publish(BY_NAME["revocations"])

        def arrived() -> bool:
            true.put(Revocations(names=["paris"]))
            got.extend(list(sample.message.names) for sample in heard.take())
            return bool(got)

        await until(arrived, "the hub's own list")
        assert ["tokyo"] not in got

    secured(tmp_path, body)


def test_only_names_of_the_conference_are_taken_as_revoked_and_none_is_taken_back(tmp_path: Path) -> None:
    async def play() -> None:
        network = MemoryNetwork()
        hub, router = [network.bus("demo", site, SystemClock()) for site in ("hub", "hub")]
        following = asyncio.create_task(follow_revocations(router, tmp_path, ["tokyo", "paris"], print))
        publication = hub.publish(BY_NAME["revocations"])
        strange = ["eve", "tokyo.1", "tokyo.5000", "tokyo\nhub", "../tokyo", "", "tokyo.2"]
        publication.put(Revocations(names=["tokyo", *strange]))
        await until(lambda: revoked_names(tmp_path) == ["tokyo", "tokyo.2"])
        publication.put(Revocations(names=["paris"]))
        await until(lambda: revoked_names(tmp_path) == ["tokyo", "tokyo.2", "paris"])
        following.cancel()

    asyncio.run(play())

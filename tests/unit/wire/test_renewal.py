"""A certificate is renewed where it is used: in simulated time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from vistel.v1.service_pb2 import CertificateReply, CertificateRequest
from vistel.wire.certificates.authority import (
    Authority,
    CertificateError,
    common_name_of,
    fault,
    files_of,
    read_certificate,
    read_key,
    write_certificate,
    write_key,
)
from vistel.wire.certificates.renewal import complete, ending, keep_renewed, renew
from vistel.wire.certificates.signer import Signer
from vistel.wire.clock import SimulatedClock

START = datetime(2026, 5, 1, tzinfo=UTC)
DAY_NS = 86_400_000_000_000


class Place:
    """A host, and a site with files of its own; both have the same time."""

    def __init__(self, folder: Path, name: str = "tokyo", hosts: tuple[str, ...] = ()) -> None:
        self.clock = SimulatedClock()
        self.authority = Authority.create(folder / "host", START)
        self.said: list[str] = []
        self.told: list[str] = []
        self.signer = Signer(self.authority, self.now, self.said.append)
        made = self.authority.issue(name, START, hosts=hosts)
        there = folder / "site"
        there.mkdir(mode=0o700)
        self.files = files_of(there, name)
        write_key(self.files.key, read_key(made.key))
        for mine, theirs in ((self.files.certificate, made.certificate), (self.files.ca, made.ca)):
            write_certificate(mine, theirs.read_bytes())
        made.key.unlink()
        self.reachable = True
        self.holder = name

    def now(self) -> datetime:
        return START + timedelta(microseconds=self.clock.now_ns() // 1000)

    async def ask(self, request: CertificateRequest) -> CertificateReply | None:
        return self.signer.answer(self.holder, request.SerializeToString()) if self.reachable else None

    def run(self, *days: float, between: Callable[[], object] = lambda: None) -> None:
        """Keep the site's certificate renewed until each of these days, with something done after each."""

        async def play() -> None:
            task = asyncio.create_task(keep_renewed(self.files, self.ask, self.clock, self.now, self.told.append))
            for day in days:
                await self.clock.advance_to_ns(round(day * DAY_NS))
                assert not task.done()
                between()
            task.cancel()

        asyncio.run(play())

    @property
    def until_days(self) -> float:
        return (read_certificate(self.files.certificate).not_valid_after_utc - START) / timedelta(days=1)


@pytest.fixture
def place(tmp_path: Path) -> Place:
    return Place(tmp_path)


def test_it_is_renewed_when_less_than_a_third_of_its_lifetime_is_left_and_again_and_again(place: Place) -> None:
    key = place.files.key.read_bytes()
    ends: list[float] = []
    place.run(59.9, 60.1, 119.0, 121.0, between=lambda: ends.append(place.until_days))
    assert ends[0] == 90 and 150 <= ends[1] < 150.1 and ends[2] == ends[1] and 210 <= ends[3] < 210.2
    assert fault(place.files, START + timedelta(days=130)) == ""
    assert place.files.key.read_bytes() != key, "with a key of its own"
    assert place.said == [f"tokyo: certificate renewed, valid until {d} UTC" for d in ("2026-09-28 00:00", "2026-11-27 00:00")]
    assert [line.split(": ")[1][:30] for line in place.told] == ["renewed, valid until 2026-09-2", "renewed, valid until 2026-11-2"]


def test_the_key_stays_with_the_site_and_the_host_keeps_the_certificate(place: Place) -> None:
    asked: list[CertificateRequest] = []

    async def ask(request: CertificateRequest) -> CertificateReply | None:
        asked.append(request)
        return await place.ask(request)

    asyncio.run(renew(place.files, ask, place.now, early=True))
    secret = place.files.key.read_bytes().splitlines()[1]
    assert secret not in asked[0].SerializeToString()
    assert (place.authority.folder / "tokyo.pem").read_bytes() == place.files.certificate.read_bytes()
    assert not (place.authority.folder / "tokyo.key").exists()
    assert {p.name: p.stat().st_mode & 0o777 for p in place.files.key.parent.glob("*.key")} == {"tokyo.key": 0o600}


def test_a_certificate_in_use_where_the_authority_is_is_not_replaced_by_that_of_another_machine(tmp_path: Path) -> None:
    place = Place(tmp_path, "hub", ("localhost", "192.0.2.7"))
    here = place.authority.issue("hub", START)
    asyncio.run(renew(place.files, place.ask, place.now, early=True))
    assert fault(here, START) == "" and fault(place.files, START) == ""


def test_addresses_and_lifetime_stay(tmp_path: Path) -> None:
    place = Place(tmp_path, "router", ("hub2.example.org", "192.0.2.8"))
    before = read_certificate(place.files.certificate)
    asyncio.run(renew(place.files, place.ask, place.now, early=True))
    after = read_certificate(place.files.certificate)
    assert after.serial_number != before.serial_number
    assert list(after.extensions) != [] and [e.value for e in after.extensions] == [e.value for e in before.extensions]
    assert after.not_valid_after_utc - after.not_valid_before_utc == before.not_valid_after_utc - before.not_valid_before_utc


def test_while_nobody_answers_it_is_told_once_a_day_when_it_ends_and_what_to_do(place: Place) -> None:
    place.reachable = False
    place.run(60.1)
    assert len(place.told) == 1
    assert "ends on 2026-07-30 00:00 UTC, in 29 days, and is not renewed: nobody who signs answers; start" in place.told[0]
    place.run(63.2)
    assert len(place.told) == 5
    place.reachable = True
    place.run(64.0)
    assert place.until_days > 150
    assert len(place.told) == 6


def test_what_ends_tonight_is_told_in_hours_and_what_has_ended_is_told_too(place: Place) -> None:
    assert ending(place.files, START + timedelta(days=59)) == ""
    assert "ends on 2026-07-30 00:00 UTC, in 6.0 hours" in ending(place.files, START + timedelta(days=89, hours=18))
    place.reachable = False
    place.run(90.5, 91.0)
    assert "has expired" in place.told[-1] and "invitation" in place.told[-1]


def test_files_that_cannot_be_written_or_read_are_told_and_end_nothing(place: Place) -> None:
    place.files.certificate.with_suffix(".lock").mkdir()
    place.run(60.1)
    assert "in 29 days, and is not renewed: Is a directory; start vistel" in place.told[0]
    place.files.certificate.write_text("broken")
    place.run(61.5)
    assert "is no certificate" in place.told[-1]


@pytest.mark.parametrize("what", ["other name", "other key", "other authority", "garbage", "refused"])
def test_an_answer_that_is_no_new_certificate_changes_nothing(place: Place, tmp_path: Path, what: str) -> None:
    other = Authority.create(tmp_path / "other", START)
    key = read_key(place.files.key).public_key()
    replies = {
        "other name": CertificateReply(certificate=place.authority.signed("paris", key, START)),
        "other key": CertificateReply(certificate=place.authority.signed("tokyo", key, START)),
        "other authority": CertificateReply(certificate=other.signed("tokyo", key, START)),
        "garbage": CertificateReply(certificate=b"garbage"),
        "refused": CertificateReply(refused="not today"),
    }

    async def ask(_: CertificateRequest) -> CertificateReply | None:
        return replies[what]

    before = place.files.key.read_bytes(), place.files.certificate.read_bytes()
    with pytest.raises(CertificateError, match="not today" if what == "refused" else "is none for this name"):
        asyncio.run(renew(place.files, ask, place.now, early=True))
    assert (place.files.key.read_bytes(), place.files.certificate.read_bytes()) == before


def test_a_machine_that_goes_down_between_the_key_and_the_certificate_comes_back_with_both(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise OSError("no power")

    with monkeypatch.context() as patch:
        patch.setattr("vistel.wire.certificates.renewal.write_certificate", fails)
        with pytest.raises(OSError, match="no power"):
            asyncio.run(renew(place.files, place.ask, place.now, early=True))
    assert "is not the key of" in fault(place.files, START)
    complete(place.files)
    assert fault(place.files, START) == ""
    assert sorted(p.name for p in place.files.key.parent.iterdir()) == ["ca.pem", "tokyo.key", "tokyo.lock", "tokyo.pem"]


def test_processes_of_one_machine_do_not_renew_the_same_certificate_at_once(place: Place) -> None:
    async def play() -> list[object]:
        waiting = asyncio.Event()

        async def slowly(request: CertificateRequest) -> CertificateReply | None:
            await waiting.wait()
            return await place.ask(request)

        first = asyncio.create_task(renew(place.files, slowly, place.now, early=True))
        await asyncio.sleep(0)
        second = await renew(place.files, place.ask, place.now, early=True)
        waiting.set()
        return [await first, second]

    first, second = asyncio.run(play())
    assert first == START + timedelta(days=90) and second is None
    assert len(place.said) == 1


def test_the_name_after_a_revoked_one_is_renewed_as_it_is(place: Place) -> None:
    place.authority.revoke("tokyo")
    made = place.authority.issue("tokyo", START)
    place.files.key.write_bytes(made.key.read_bytes())
    place.files.certificate.write_bytes(made.certificate.read_bytes())
    asyncio.run(renew(place.files, place.ask, place.now, early=True))
    assert common_name_of(read_certificate(place.files.certificate)) == "tokyo.2"

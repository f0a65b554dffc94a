"""The lease of a room: a lock on one machine, etcd, and Kubernetes keep the same rules."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import ssl
import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from lease_stores import answers, etcd, kubernetes
from pydantic import ValidationError

from vistel.conference.model import Conference
from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SimulatedClock
from vistel.wire.lease.etcd import EtcdLease
from vistel.wire.lease.file import FileLease
from vistel.wire.lease.kinds import open_lease
from vistel.wire.lease.kubernetes import KubernetesLease
from vistel.wire.lease.lease import Holder, Lease, LeaseStoreError
from vistel.wire.world.presence import MOST_TERM
from vistel_services.world.leadership import Leadership

KINDS = ["file", "etcd", "kubernetes"]


@dataclass
class Store:
    """Where leases are. open: of a world at a place; end: let the lease that is held run out; spoil: write nonsense there."""

    open: Callable[[str], Any]
    end: Callable[[Any], Awaitable[None]]
    spoil: Callable[[], Awaitable[None]]


@asynccontextmanager
async def store(kind: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Store]:
    clock = SimulatedClock(10**18)
    opened: list[Lease] = []

    def kept(lease: Any) -> Any:
        opened.append(lease)
        return lease

    async def passes(_lease: Any) -> None:
        await clock.advance_to_ns(clock.now_ns() + 16_000_000_000)

    async with AsyncExitStack() as stack:
        if kind == "file":

            async def spoil() -> None:
                (folder / "lease").write_bytes(b"\xff")

            yield Store(lambda place: kept(FileLease(folder / "lease", place)), lambda lease: lease.release(), spoil)
        elif kind == "etcd":
            monkeypatch.setattr(EtcdLease, "lasts_s", 3600.0)  # etcd counts real time, in which a machine may stand still
            address = stack.enter_context(etcd(folder))
            await answers(address)

            async def spoil() -> None:
                lease = EtcdLease([f"http://{address}"], "demo", "x")
                await lease._if([], [lease._put("led", "nonsense")])
                await lease.close()

            yield Store(lambda place: kept(EtcdLease([f"http://{address}"], "demo", place)), lambda lease: lease.release(), spoil)
        else:
            api, account = await stack.enter_async_context(kubernetes(folder, monkeypatch))

            async def spoil() -> None:
                api.objects["vistel-demo"] = {"metadata": {"resourceVersion": "7"}, "spec": {"leaseTransitions": "x"}}

            yield Store(lambda place: kept(KubernetesLease("demo", place, clock, account)), passes, spoil)
        for lease in opened:
            await lease.close()


def tried(kind: str, folder: Path, monkeypatch: pytest.MonkeyPatch, play: Callable[[Store], Awaitable[None]]) -> None:
    async def whole() -> None:
        async with store(kind, folder, monkeypatch) as s:
            await play(s)

    asyncio.run(whole())


@pytest.mark.parametrize("kind", KINDS)
def test_one_at_a_time_holds_a_lease_under_a_term_that_grows(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(s: Store) -> None:
        one, two = s.open("hub"), s.open("osaka")
        assert await one.holder() == await two.holder() == Holder()
        nobody = await two.holder()
        assert await one.acquire(await one.holder(), 0)
        assert not await two.acquire(nobody, 0), "held"
        assert (await two.holder()).held and await one.renew() and not await two.renew()
        assert await one.note_led() and not await two.note_led()
        seen = await two.holder()
        assert seen == Holder(0, True, 0, "hub")
        await one.release()
        seen = await two.holder()
        assert seen == Holder(0, False, 0, "hub")
        assert await two.acquire(seen, 7)
        assert not await one.renew() and not await one.note_led()
        assert await one.holder() == Holder(7, True, 0, "hub"), "who acquired it and has not led has no steps"
        assert await two.note_led()
        assert await one.holder() == Holder(7, True, 7, "osaka")

    tried(kind, tmp_path, monkeypatch, play)


@pytest.mark.parametrize("kind", KINDS)
def test_who_has_not_seen_the_last_holder_does_not_acquire(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(s: Store) -> None:
        one, two = s.open("hub"), s.open("osaka")
        old = await two.holder()
        assert await one.acquire(await one.holder(), 0)
        await one.release()
        assert not await two.acquire(old, 0)
        assert await two.acquire(await two.holder(), 1)

    tried(kind, tmp_path, monkeypatch, play)


@pytest.mark.parametrize("kind", KINDS)
def test_a_lease_that_is_not_renewed_ends_and_is_not_taken_back(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(s: Store) -> None:
        one, two = s.open("hub"), s.open("osaka")
        assert await one.acquire(await one.holder(), 0) and await one.note_led()
        await two.holder()
        await s.end(one)
        seen = await two.holder()
        assert seen == Holder(0, False, 0, "hub")
        assert await two.acquire(seen, 1)
        assert not await one.renew() and not await one.note_led()
        await one.release()
        assert (await one.holder()).held, "who lost it cannot end another's"

    tried(kind, tmp_path, monkeypatch, play)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_lease_is_reported_in_a_line(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(s: Store) -> None:
        await s.spoil()
        with pytest.raises(LeaseStoreError, match=r"holds no lease.*; (remove|delete) it") as raised:
            await s.open("hub").holder()
        assert "\n" not in str(raised.value)

    tried(kind, tmp_path, monkeypatch, play)


HOLD = """
import asyncio, sys
from pathlib import Path
from vistel.wire.lease.file import FileLease
from vistel.wire.lease.lease import Holder
lease = FileLease(Path(sys.argv[1]), "hub")
assert asyncio.run(lease.acquire(Holder(), 4)) and asyncio.run(lease.note_led())
print("holds", flush=True)
sys.stdin.read()
"""


def test_a_process_that_is_killed_holds_the_lock_no_longer_and_its_term_is_known(tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", HOLD, str(tmp_path / "lease")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None and process.stdout.readline() == "holds\n"
        lease = FileLease(tmp_path / "lease", "osaka")
        seen = asyncio.run(lease.holder())
        assert seen == Holder(4, True, 4, "hub") and not asyncio.run(lease.acquire(seen, 5))
        process.send_signal(signal.SIGKILL)
        process.wait()
    seen = asyncio.run(lease.holder())
    assert seen == Holder(4, False, 4, "hub") and asyncio.run(lease.acquire(seen, 5))


def test_a_lock_whose_file_was_removed_is_held_no_longer(tmp_path: Path) -> None:
    lease = FileLease(tmp_path / "lease", "hub")
    assert asyncio.run(lease.acquire(Holder(), 0)) and asyncio.run(lease.renew())
    (tmp_path / "lease.lock").unlink()
    assert not asyncio.run(lease.renew())


def test_a_disk_that_refuses_ends_no_room_and_is_reported(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "no-folder").write_bytes(b"")
    alone = FileLease(tmp_path / "no-folder/lease", "hub")
    assert asyncio.run(alone.acquire(Holder(), 0)) and "lease not shared" in caplog.text
    full = FileLease(tmp_path / "lease", "hub")
    (tmp_path / "lease").mkdir()  # so that nothing can be written there
    with pytest.raises(LeaseStoreError):
        asyncio.run(full.acquire(Holder(), 0))
    (tmp_path / "lease").rmdir()
    assert asyncio.run(full.acquire(Holder(), 0))
    (tmp_path / "lease").unlink()
    (tmp_path / "lease").mkdir()
    assert asyncio.run(full.note_led()) and "leader not noted" in caplog.text
    assert asyncio.run(full.holder()) == Holder(0, True, 0, "hub")


def test_etcd_on_another_machine_is_asked_with_certificates_and_refuses_who_has_none(tmp_path: Path) -> None:
    now = datetime.now(UTC)
    authority = Authority.create(tmp_path, now)
    mine = authority.issue("hub", now)
    stranger = ssl.create_default_context(cafile=mine.ca)
    with etcd(tmp_path, authority.issue("etcd", now, hosts=["127.0.0.1"])) as address:

        async def play() -> None:
            lease = open_lease(f"etcd://{address}", None, "demo", "hub", SimulatedClock(1), mine)
            without = EtcdLease([f"https://{address}"], "demo", "osaka", stranger)
            while True:
                try:
                    assert await lease.acquire(await lease.holder(), 0)
                    break
                except LeaseStoreError:  # it has not begun yet
                    await asyncio.sleep(0.05)
            with pytest.raises(LeaseStoreError):
                await without.holder()
            await lease.close()
            await without.close()

        asyncio.run(play())


def test_a_member_of_etcd_that_is_gone_is_left_for_the_next(tmp_path: Path) -> None:
    with etcd(tmp_path) as address:

        async def play() -> None:
            await answers(address)
            lease = open_lease(f"etcd://127.0.0.1:9,{address}", None, "demo", "hub", SimulatedClock(1), None)
            with pytest.raises(LeaseStoreError, match=r"http://127\.0\.0\.1:9: "):
                await lease.holder()
            assert await lease.acquire(await lease.holder(), 0)
            await lease.close()

        asyncio.run(play())


# -- how long it lasts -----------------------------------------------------------------------------------------


class _Leash:
    """A lease in memory whose store can be gone: for what `Leadership` makes of its answers."""

    lasts_s = 5.0

    def __init__(self) -> None:
        self.gone = self.silent = self.lost = False
        self.renewed = 0

    async def _asked(self) -> None:
        if self.silent:
            await asyncio.Event().wait()
        if self.gone:
            raise LeaseStoreError("http://etcd: refused")

    async def holder(self) -> Holder:
        await self._asked()
        return Holder()

    async def acquire(self, seen: Holder, term: int) -> bool:
        await self._asked()
        return True

    async def renew(self) -> bool:
        await self._asked()
        self.renewed += 1
        return not self.lost

    async def note_led(self) -> bool:
        await self._asked()
        return True

    release = close = _asked


@pytest.mark.parametrize("how", ["gone", "silent"])
def test_a_leader_whose_store_is_gone_goes_on_until_its_lease_ends_and_says_so_once(
    how: str, caplog: pytest.LogCaptureFixture
) -> None:
    async def play() -> None:
        clock, lease = SimulatedClock(1), _Leash()
        leadership = Leadership(lease, clock)
        assert not leadership.lasts
        assert await leadership.acquire(Holder(), -1) == 0 and leadership.lasts
        await clock.advance_to_ns(60_000_000_000)
        assert leadership.lasts and lease.renewed > 50
        setattr(lease, how, True)
        await clock.advance_to_ns(clock.now_ns() + 2_500_000_000)
        assert leadership.lasts
        assert caplog.text.count("lease store gone") == 1 and "goes on leading until its lease ends in" in caplog.text
        await clock.advance_to_ns(clock.now_ns() + 1_600_000_000)
        assert not leadership.lasts
        waiting = asyncio.create_task(leadership.holder())
        await clock.advance_to_ns(clock.now_ns() + 1_100_000_000)
        assert await waiting is None
        setattr(lease, how, False)
        await leadership.release()
        assert caplog.text.count("lease store gone") == 1 and "lease ended; this world stops leading" in caplog.text
        assert await leadership.acquire(Holder(0, False, 0, "hub"), 0) == 1 and leadership.lasts
        assert "lease store back" in caplog.text
        await leadership.release()

    with caplog.at_level(logging.INFO):
        asyncio.run(play())


def test_a_leader_that_is_told_that_its_lease_is_another_s_stops_at_once() -> None:
    async def play() -> None:
        clock, lease = SimulatedClock(1), _Leash()
        leadership = Leadership(lease, clock)
        assert await leadership.acquire(Holder(), 4) == 5
        lease.lost = True
        await clock.advance_to_ns(1_100_000_000)
        assert not leadership.lasts
        await leadership.release()

    asyncio.run(play())


def test_nobody_leads_after_the_last_term(caplog: pytest.LogCaptureFixture) -> None:
    async def play() -> None:
        assert await Leadership(_Leash(), SimulatedClock(1)).acquire(Holder(MOST_TERM, False, 0, "hub"), 3) == -1

    asyncio.run(play())
    assert f"{MOST_TERM} is the last term" in caplog.text


# -- the conference file ---------------------------------------------------------------------------------------

SITES = [{"name": "osaka", "participants": [{"name": "aiko"}]}]
APART = {"mode": "routed", "endpoints": ["tls/hub.example.org:7447"], "tls": {"ca": "a", "certificate": "b", "key": "c"}}


@pytest.mark.parametrize("lease", ["file", "etcd://127.0.0.1:2379", "etcd://127.0.0.1:2379,localhost:2380", "kubernetes"])
def test_leases_that_a_conference_file_may_name(lease: str) -> None:
    conference = Conference.model_validate({"sites": SITES, "world": {"lease": lease, "waiting": ["osaka"]}})
    assert conference.world.lease == lease and not conference.world.lease_encrypted


@pytest.mark.parametrize(
    ("bus", "lease", "what"),
    [
        ({}, "zookeeper", "world.lease"),
        ({}, "etcd://", "world.lease"),
        ({}, "etcd://10.0.0.7", "world.lease"),
        ({}, "etcd://10.0.0.7:2379", r"10.0.0.7:2379 is on another machine, which needs certificates: \[bus.tls\]"),
        (APART, "file", '"file" is for worlds on one machine; expected "etcd://HOST:PORT" or "kubernetes"'),
    ],
)
def test_a_lease_that_cannot_be_is_refused(bus: dict[str, Any], lease: str, what: str) -> None:
    with pytest.raises(ValidationError, match=what):
        Conference.model_validate({"sites": SITES, "bus": bus, "world": {"lease": lease, "waiting": ["osaka"]}})


def test_where_worlds_are_apart_the_lease_is_one_that_all_of_them_reach() -> None:
    conference = Conference.model_validate(
        {"sites": SITES, "bus": APART, "world": {"lease": "etcd://10.0.0.7:2379", "waiting": ["osaka"]}}
    )
    assert conference.world.lease_encrypted

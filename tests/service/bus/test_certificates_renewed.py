"""Certificates are renewed over real routers and links, and what was revoked reaches routers elsewhere."""

from __future__ import annotations

import asyncio
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from secured_bus import Secured, secured
from waiting import until

from vistel.conference.connect import connect
from vistel.conference.files import load
from vistel.wire.certificates.authority import Authority, files_of, read_certificate
from vistel.wire.certificates.renewal import keep_renewed
from vistel.wire.certificates.signer import Signer
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import ZenohBus
from vistel.wire.zenoh.endpoints import free_port

FILE = """
name = "demo"
[bus]
mode = "routed"
endpoints = ["tls/localhost:{port}"]
tls = {{ folder = "certificates" }}
[[sites]]
name = "tokyo"
participants = [{{ name = "ann" }}]
[[sites]]
name = "paris"
participants = [{{ name = "bob" }}]
"""


def now() -> datetime:
    return datetime.now(UTC)


@pytest.mark.parametrize("protocol", ["tls", "quic"])
def test_a_session_goes_on_past_the_end_of_the_certificate_with_which_it_began(tmp_path: Path, protocol: str) -> None:
    async def body(s: Secured) -> None:
        hub = await s.door("hub")
        serve_clock(hub, SystemClock())
        Signer(s.authority, now).serve(hub, ["tokyo"])
        folder = tmp_path / "tokyo"
        folder.mkdir(mode=0o700)
        made = s.authority.issue("tokyo", now(), valid=timedelta(seconds=24))
        files = files_of(folder, "tokyo")
        for mine, theirs in ((files.ca, made.ca), (files.certificate, made.certificate), (files.key, made.key)):
            shutil.copy(theirs, mine)
        made.key.unlink()
        first = read_certificate(files.certificate)
        bus = await s.door("tokyo", files)
        keeping = asyncio.create_task(
            keep_renewed(
                files, lambda r: bus.query(BY_NAME["certificate"], r, holder="tokyo"), SystemClock(), now, lambda line: None
            )
        )
        await until(lambda: read_certificate(files.certificate) != first, "the first renewal", tasks=[keeping])
        assert now() < first.not_valid_after_utc
        second = read_certificate(files.certificate)
        await until(lambda: now() > first.not_valid_after_utc, tasks=[keeping])
        while await bus.query(BY_NAME["clock"], timeout_s=0.3) is None:
            pass
        await until(lambda: read_certificate(files.certificate) != second, "the renewal by what came of the first", tasks=[keeping])
        keeping.cancel()

    secured(tmp_path / "host", body, protocol=protocol)


def vistel(*words: str | Path) -> None:
    """A command that must end well."""
    subprocess.run([sys.executable, "-m", "vistel_cli.main", *map(str, words)], check=True, stdout=subprocess.DEVNULL)


@contextmanager
def running(log: Path, *words: str | Path) -> Iterator[None]:
    """A command that runs during the block, and ends well after it."""
    with log.open("w") as stream:
        command = [sys.executable, "-m", "vistel_cli.main", *map(str, words)]
        process = subprocess.Popen(command, stdout=stream, stderr=subprocess.STDOUT, env=os.environ | {"PYTHONUNBUFFERED": "1"})
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait() == 0, log.read_text()


async def said(log: Path, text: str) -> None:
    await until(lambda: text in log.read_text(), f"{text!r} in {log.name}")


def machine(folder: Path, host: Path, *names: str) -> Path:
    """The conference file on another machine, with these certificates and without the authority's key."""
    (folder / "certificates").mkdir(parents=True, mode=0o700)
    for name in ("ca.pem", *(f"{n}.{kind}" for n in names for kind in ("pem", "key"))):
        shutil.copy(host.parent / "certificates" / name, folder / "certificates" / name)
    return Path(shutil.copy(host, folder / "conference.toml"))


@pytest.fixture
def host(tmp_path: Path) -> Path:
    """The conference file beside a new authority."""
    file = tmp_path / "host/conference.toml"
    file.parent.mkdir()
    file.write_text(FILE.format(port=free_port()))
    vistel("site", "certs", "init", file)
    return file


def test_the_router_and_a_recorder_elsewhere_renew_what_ends_soon_by_themselves(host: Path, tmp_path: Path) -> None:
    authority = Authority(host.parent / "certificates")
    authority.issue("hub", now() - timedelta(days=80), hosts=["localhost", "127.0.0.1"])
    there = machine(tmp_path / "there", host, "hub")
    logs = tmp_path / "router.txt", tmp_path / "recorder.txt"

    async def play() -> None:
        with running(logs[0], "site", "router", host):
            await said(logs[0], "hub.pem: renewed, valid until")
            await said(logs[0], "certificates read again")
            with running(logs[1], "record", there, "--out", tmp_path / "out"):
                await said(logs[1], "hub.pem: renewed, valid until")
                await said(logs[0], "hub: certificate renewed, valid until")

    asyncio.run(play())
    for folder in (host.parent, there.parent):
        left = read_certificate(folder / "certificates/hub.pem").not_valid_after_utc - now()
        assert timedelta(days=89) < left < timedelta(days=91)
    keys = [(f / "certificates/hub.key").read_bytes() for f in (host.parent, there.parent)]
    assert keys[0] != keys[1]


def test_a_second_router_without_the_authority_cuts_off_who_was_revoked_at_the_first(host: Path, tmp_path: Path) -> None:
    vistel("site", "certs", "add", host, "tokyo", "paris", "router")
    second = machine(tmp_path / "second", host, "router")
    sites = machine(tmp_path / "sites", host, "tokyo", "paris")
    ports = free_port(), free_port()
    at = [f"tls/127.0.0.1:{port}" for port in ports]
    logs = tmp_path / "first.txt", tmp_path / "second.txt"
    conference = load(sites)

    async def answered(bus: ZenohBus) -> bool:
        return await bus.query(BY_NAME["clock"], timeout_s=0.3) is not None

    async def play() -> None:
        with running(logs[0], "site", "router", host, "--listen", at[0]):
            await said(logs[0], "router of demo")
            with running(logs[1], "site", "router", second, "--listen", at[1], "--join", at[0]):
                await said(logs[1], "router of demo")
                tokyo, paris = [await connect(conference, s, SystemClock(), at[1]) for s in ("tokyo", "paris")]
                while not (await answered(tokyo) and await answered(paris)):
                    pass
                vistel("site", "certs", "revoke", host, "tokyo")
                await said(logs[1], "certificates read again; revoked: tokyo")
                while not await answered(paris):
                    pass
                assert not await answered(tokyo)
                for bus in (tokyo, paris):
                    await bus.close()

    asyncio.run(play())
    assert (second.parent / "certificates/revoked.txt").read_text() == "tokyo\n"


def test_where_the_router_has_no_authority_a_process_beside_it_signs_and_tells_what_was_revoked(host: Path, tmp_path: Path) -> None:
    authority = Authority(host.parent / "certificates")
    authority.issue("hub", now() - timedelta(days=80), hosts=["localhost", "127.0.0.1"])
    router = machine(tmp_path / "router", host, "hub")
    vistel("site", "certs", "renew", host)
    vistel("site", "certs", "add", host, "tokyo")
    site = machine(tmp_path / "site", host, "tokyo")
    before = (site.parent / "certificates/tokyo.key").read_bytes()
    logs = tmp_path / "router.txt", tmp_path / "authority.txt"

    async def play() -> None:
        with running(logs[0], "site", "router", router):
            await said(logs[0], "is not renewed: nobody who signs answers; start vistel site router, or vistel site certs serve")
            with running(logs[1], "site", "certs", "serve", host):
                await said(logs[1], "authority of demo")
                vistel("site", "certs", "renew", site)
                await said(logs[1], "tokyo: certificate renewed, valid until")
                vistel("site", "certs", "revoke", host, "tokyo")
                await said(logs[0], "certificates read again; revoked: tokyo")

    asyncio.run(play())
    assert (site.parent / "certificates/tokyo.key").read_bytes() != before

"""Somebody connects with a certificate that counts no more, or not for that. What it needs: to have had one."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import typer
from secured_bus import Secured, secured
from typer.testing import CliRunner
from waiting import until

from vistel.conference.connect import connect
from vistel.conference.files import load
from vistel.wire.certificates.authority import Authority, read_key, write_key
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import BusError, Router, ZenohBus
from vistel.wire.zenoh.endpoints import free_port
from vistel_cli.main import app
from vistel_cli.site.link import check_link

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


@pytest.mark.parametrize("days", [-1, 10], ids=["expired", "not good yet"])
def test_certificates_that_are_not_good_now_do_not_connect(tmp_path: Path, days: int) -> None:
    async def body(s: Secured) -> None:
        start = datetime.now(UTC) + timedelta(days=days)
        files = s.authority.issue("paris", start, valid=timedelta(hours=1))
        with pytest.raises(BusError, match=r"is it running there\? If so, the certificates do not match"):
            await s.door("paris", files, connect_s=0.5)
        assert await (await s.door("tokyo")).query(BY_NAME["clock"], timeout_s=0.1) is None

    secured(tmp_path, body)


def test_the_certificate_of_a_site_is_no_router(tmp_path: Path) -> None:
    async def body(s: Secured) -> None:
        paris = s.issue("paris")
        port = free_port()
        router = Router.open(f"tls/127.0.0.1:{port}", tls=paris)
        try:
            with pytest.raises(BusError, match="certificates do not match"):
                await ZenohBus.open(
                    conference="demo",
                    site="tokyo",
                    clock=SystemClock(),
                    endpoints=[f"tls/localhost:{port}"],
                    tls=s.issue("tokyo"),
                    connect_s=0.5,
                )
        finally:
            router.close()

    secured(tmp_path, body)


@pytest.mark.parametrize("protocol", ["tls", "quic"])
def test_a_router_with_the_certificate_of_another_address_is_not_used(tmp_path: Path, protocol: str) -> None:
    async def body(s: Secured) -> None:
        async def at(address: str) -> None:
            endpoints = [f"{protocol}/{address}:{s.port}"]
            tls, clock = s.issue("tokyo"), SystemClock()
            bus = await ZenohBus.open(conference="demo", site="tokyo", clock=clock, endpoints=endpoints, tls=tls)
            await bus.close()

        await at("127.0.0.1")
        with pytest.raises(BusError, match="certificates do not match"):
            await at("127.0.0.2")

    secured(tmp_path, body, protocol=protocol, address="0.0.0.0")


@pytest.mark.parametrize("protocol", ["tls", "quic"])
def test_a_revoked_certificate_is_cut_off_while_the_router_runs_and_a_new_one_is_let_in(tmp_path: Path, protocol: str) -> None:
    file = tmp_path / "conference.toml"
    file.write_text(FILE.format(port=free_port(protocol)).replace("tls/", f"{protocol}/"))
    vistel("init", file)
    vistel("add", file, "tokyo", "paris")
    words = [sys.executable, "-m", "vistel_cli.main", "site", "router", str(file)]
    router = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert router.stdout is not None and router.stdout.readline().startswith("router of demo")
    conference = load(file)

    async def answered(bus: ZenohBus) -> bool:
        return await bus.query(BY_NAME["clock"], timeout_s=0.3) is not None

    async def play() -> None:
        tokyo, paris = [await connect(conference, s, SystemClock(), *conference.bus.endpoints) for s in ("tokyo", "paris")]
        while not (await answered(tokyo) and await answered(paris)):
            pass
        vistel("revoke", file, "tokyo")
        while await answered(tokyo):
            pass
        await until(lambda: paris.connected)
        while not await answered(paris):
            pass
        assert not await answered(tokyo)
        vistel("add", file, "tokyo", "--force")
        again = await connect(conference, "tokyo", SystemClock(), *conference.bus.endpoints)
        while not await answered(again):
            pass
        assert not await answered(tokyo), "whoever has the old files stays out"
        for bus in (tokyo, paris, again):
            await bus.close()

    try:
        asyncio.run(play())
    finally:
        router.send_signal(signal.SIGINT)
        assert router.wait() == 0
    assert [i.state(datetime.now(UTC)) for i in Authority(tmp_path / "certificates").issued()] == ["valid"] * 4


def vistel(command: str, *words: str | Path) -> None:
    """`vistel site certs`, which must end well."""
    done = CliRunner().invoke(app, ["site", "certs", command, *map(str, words)])
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize(
    ("case", "why"),
    [
        ("good", ""),
        ("nobody there", ""),
        ("other authority", "the router's certificate is not good here"),
        ("other address", "IP address mismatch"),
        ("somebody else's", "is the certificate of paris, which cannot speak for tokyo"),
        ("expired", "expired on"),
        ("plain", "is not encrypted"),
        ("none", "no certificate of tokyo is here"),
        ("unknown to the router", "answers, but not this certificate"),
    ],
)
def test_who_would_be_refused_is_told_why_before_anything_starts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], case: str, why: str
) -> None:
    async def body(s: Secured) -> None:
        hub = await s.door("hub")
        serve_clock(hub, SystemClock())
        there = Authority.create(tmp_path / "certificates", datetime.now(UTC)) if case == "other authority" else s.authority
        valid = timedelta(seconds=-1) if case == "expired" else timedelta(days=30)
        site = "lima" if case == "unknown to the router" else "tokyo"
        files = there.issue("paris" if case == "somebody else's" else site, datetime.now(UTC), valid=valid)
        (tmp_path / "conference.toml").write_text(FILE.replace("tokyo", site).format(port=s.port))
        mine = tmp_path / "certificates"
        mine.mkdir(exist_ok=True)
        (mine / "ca.pem").write_bytes(files.ca.read_bytes())
        if case != "none":
            (mine / f"{site}.pem").write_bytes(files.certificate.read_bytes())
            write_key(mine / f"{site}.key", read_key(files.key))
        places = {"other address": f"tls/127.0.0.2:{s.port}", "plain": f"tcp/127.0.0.1:{s.port}", "nobody there": "tls/127.0.0.1:9"}
        endpoint = places.get(case, f"tls/localhost:{s.port}")
        with contextlib.suppress(typer.Exit):
            await asyncio.to_thread(check_link, load(tmp_path / "conference.toml"), site, endpoint)

    secured(tmp_path / "host", body, address="0.0.0.0")
    said = capsys.readouterr().err
    assert why in said and bool(said) == bool(why)
    assert len(said.splitlines()) <= 1

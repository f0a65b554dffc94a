"""`vistel doctor FILE --site NAME` over a real router: what is measured, and what it says that means."""

from __future__ import annotations

import asyncio
import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from vistel.conference.files import load
from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.link.quality import LinkQuality
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_cli.main import app
from vistel_cli.site.link_report import certificate_end, meaning

FILE = """name = "demo"
[[sites]]
name = "tokyo"
participants = [{ name = "aiko" }]
[[sites]]
name = "columbus"
participants = [{ name = "ben" }, { name = "carla" }]
"""
GOOD = LinkQuality(0.06, 0.01, 0.0, 0, 5e6, 5e6)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "conference.toml"
    path.write_text(FILE)
    return path


def test_a_link_is_measured_over_a_running_router(file: Path) -> None:
    async def scene() -> dict[str, Any]:
        router = Router.open()
        hub = await ZenohBus.open(conference="demo", site="hub", clock=SystemClock(), endpoints=[router.endpoint])
        serve_clock(hub, SystemClock())
        words = ["doctor", str(file), "--site", "tokyo", "--hub", router.endpoint, "--json"]
        try:
            while True:  # on a busy machine some probes are not answered in time
                done = await asyncio.to_thread(CliRunner().invoke, app, words)
                print(done.stdout, done.stderr)
                if done.exit_code == 0 and json.loads(done.stdout)["unanswered"] == 0:
                    return json.loads(done.stdout)
        finally:
            await hub.close()
            router.close()

    found = asyncio.run(scene())
    assert found["up_bit_s"] > 52e3 and found["down_bit_s"] > 52e3 and found["enough"]
    assert found["round_trip_s"] > 0.0


def test_when_the_certificate_ends_and_whether_it_is_renewed_is_told(tmp_path: Path) -> None:
    start = datetime(2026, 5, 1, tzinfo=UTC)
    files = Authority.create(tmp_path, start).issue("tokyo", start)
    assert certificate_end(files, True, start) == ("until 2026-07-30, 90 days; renewed by itself from 2026-06-30 on", "")
    assert certificate_end(files, False, start) == ("until 2026-07-30, 90 days; nobody who renews it is there now", "")
    late = start + timedelta(days=70)
    assert certificate_end(files, True, late) == ("until 2026-07-30, 20 days; renewed by itself when the site joins", "")
    row, line = certificate_end(files, False, late)
    assert row == "until 2026-07-30, 20 days; nobody who renews it is there now"
    assert "tokyo.pem: ends on 2026-07-30 00:00 UTC, in 20 days, and is not renewed: nobody who signs is there now; start" in line


def said(file: Path, found: LinkQuality, site: str = "tokyo", endpoint: str = "tls/hub:7447") -> tuple[bool, str]:
    enough, lines = meaning(load(file), site, endpoint, found)
    return enough, "\n".join(lines)


def test_a_good_link_is_enough_and_motion_is_in_time(file: Path) -> None:
    enough, text = said(file, GOOD)
    assert enough and "send about 52 kbit/s: the link carries that" in text and "receive about 124 kbit/s" in text
    assert "after 30 ms to 40 ms, in time" in text and "QUIC" not in text


@pytest.mark.parametrize(
    ("change", "enough", "words"),
    [
        ({"up_bit_s": 30e3}, False, "send about 52 kbit/s: the link carries less. Voices will break"),
        ({"up_bit_s": 40e3}, True, "send about 52 kbit/s: the link carries less. Fewer frames of motion and poorer voices go"),
        ({"up_bit_s": 60e3}, True, "send about 52 kbit/s: the link carries just that"),
        ({"down_bit_s": 100e3}, False, "receive about 124 kbit/s: the link carries less"),
        ({"down_bit_s": None}, True, "was not measured: try again when nobody else does"),
        ({"round_trip_s": 0.3}, True, "figures are shown about 160 ms after people move"),
        ({"round_trip_s": 1.1}, True, "most = 0.56 under [playout]"),
        ({"loss": 0.03}, True, "let UDP pass, and name quic/HOST:PORT first"),
    ],
)
def test_what_is_short_is_told_with_what_mends_it(file: Path, change: dict[str, float], enough: bool, words: str) -> None:
    is_enough, text = said(file, LinkQuality(**{**GOOD.__dict__, **change}))
    assert is_enough == enough and words in text


def test_losses_over_quic_need_no_advice(file: Path) -> None:
    lossy = LinkQuality(**{**GOOD.__dict__, "loss": 0.05})
    assert "QUIC" not in said(file, lossy, endpoint="quic/hub:7447,tls/hub:7447")[1]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["FILE"], "conference.toml: expected --site with one of tokyo, columbus"),
        (["--site", "tokyo"], "expected the conference file of the site"),
        (["FILE", "--site", "lima"], "no site is called 'lima'; expected --site with one of tokyo, columbus"),
        (["FILE", "--site", "tokyo", "--hub", "tcp/127.0.0.1:9"], "127.0.0.1:9"),
    ],
)
def test_what_cannot_be_measured_is_said_in_one_line(file: Path, words: list[str], why: str) -> None:
    done = CliRunner().invoke(app, ["doctor", *(str(file) if w == "FILE" else w for w in words)], env={"COLUMNS": "300"})
    assert done.exit_code in (1, 2)
    assert why in done.stderr and "Traceback" not in done.stderr

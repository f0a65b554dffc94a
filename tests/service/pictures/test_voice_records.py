"""What a page makes of messages of voices (clients/web/connection/hearing.ts), in node: each record once, none of a broken one."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vistel.audio.forwarded_voices import FORMAT, record_of

ROOT = Path(__file__).resolve().parents[3]
ESBUILD = ROOT / "clients/web/node_modules/.bin/esbuild"
READ = """
import { readFileSync } from "node:fs";
import { recordsOf } from "./hearing.mjs";
const bytes = (hex) => new Uint8Array(Buffer.from(hex, "hex")).buffer;
const plain = (r) => [r.name, r.capturedMs, r.delayMs, Buffer.from(r.packet).toString("hex")];
console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf-8")).map((hex) => [...recordsOf(bytes(hex))].map(plain))));
"""
ANN, BEN = (record_of(name, 1_500_000_000, 250_000_000, name.encode() * 20, talking=True) for name in ("ann", "ben"))
HEAD = bytes([FORMAT])


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the page's reader of messages."""
    if not ESBUILD.exists() or shutil.which("node") is None:
        pytest.skip("the packages of the pages are not here (make web), or no node")
    folder = tmp_path_factory.mktemp("page")
    source = ROOT / "clients/web/connection/hearing.ts"
    outfile = f"--outfile={folder / 'hearing.mjs'}"
    subprocess.run([ESBUILD, source, "--bundle", "--format=esm", outfile, "--log-level=error"], check=True)
    (folder / "read.mjs").write_text(READ)
    return folder


def read(page: Path, *messages: bytes) -> list[list[Any]]:
    """The records of each message; one that is never done with fails."""
    given_to_it = json.dumps([m.hex() for m in messages])
    done = subprocess.run(
        ["node", "read.mjs"], cwd=page, check=True, capture_output=True, text=True, input=given_to_it, timeout=120
    )
    return json.loads(done.stdout)


def told(name: str) -> list[Any]:
    return [name, 1500.0, 250.0, (name.encode() * 20).hex()]


def test_each_record_of_a_message_is_read_once(page: Path) -> None:
    assert read(page, HEAD + ANN + BEN, HEAD, b"") == [[told("ann"), told("ben")], [], []]


@pytest.mark.parametrize("size", [0, 1, 15, 16, 19, 0xFFFF], ids=lambda s: f"{s} bytes")
def test_a_record_that_says_a_size_it_cannot_have_ends_the_message_and_what_came_before_it_counts(page: Path, size: int) -> None:
    broken = struct.pack("<H", size) + BEN[2:]
    assert read(page, HEAD + ANN + broken + ANN) == [[told("ann")]]


def test_a_record_of_no_time_ends_the_message(page: Path) -> None:
    at_no_time = [BEN[:4] + struct.pack("<d", t) + BEN[12:] for t in (float("nan"), float("inf"), 1e300)]
    late_for_ever = BEN[:12] + struct.pack("<f", float("nan")) + BEN[16:]
    assert read(page, *(HEAD + ANN + b + ANN for b in (*at_no_time, late_for_ever))) == [[told("ann")]] * 4


@settings(max_examples=5, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(messages=st.lists(st.binary(max_size=300), min_size=40, max_size=60))
def test_no_bytes_at_all_are_read_beyond_their_end_or_for_ever(page: Path, messages: list[bytes]) -> None:
    for message, records in zip(messages, read(page, *messages), strict=True):
        assert sum(16 + len(r[3]) // 2 for r in records) < max(len(message), 1)

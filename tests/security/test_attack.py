"""`vistel doctor --attack` finds a router that lets through what it should not, and nothing at one that does not."""

from __future__ import annotations

import asyncio
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from secured_bus import Secured, secured

from vistel.v1.world_pb2 import WorldHandover, WorldSnapshot
from vistel.wire.certificates.signer import Signer
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh import config
from vistel_cli.site.attack import report

FILE = """
name = "demo"
observers = ["guest"]
[bus]
mode = "routed"
endpoints = ["{endpoint}"]
tls = {{ folder = "{folder}" }}
[[sites]]
name = "tokyo"
participants = [{{ name = "ann" }}]
[[sites]]
name = "paris"
participants = [{{ name = "bob" }}]
"""
ROOM = {"to get the private state of the room", "to take the room", "to get another's certificate by renewing it"}


@pytest.mark.parametrize("open_to_all", [True, False], ids=["a router with holes", "a router"])
def test_what_a_router_lets_through_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], open_to_all: bool
) -> None:
    if open_to_all:
        monkeypatch.setattr(config, "question_limits", list)
    codes: list[int] = []
    attempts: list[dict[str, Any]] = []
    expected = ROOM | {"to have 200 questions for the room answered at once"} if open_to_all else set[str]()

    def let_through() -> set[str]:
        return {a["tries"] for a in attempts if not a["stopped"]}

    async def body(s: Secured) -> None:
        s.authority.issue("old", s.authority.certificate.not_valid_before_utc)
        s.authority.revoke("old")
        file = tmp_path / "conference.toml"
        file.write_text(FILE.format(endpoint=s.endpoint, folder=s.authority.folder))
        hub = await s.door("hub")
        for topic, answer in (
            ("world_save", WorldSnapshot()),
            ("world_snapshot", WorldSnapshot()),
            ("world_handover", WorldHandover()),
        ):
            hub.serve(BY_NAME[topic], lambda _, answer=answer: answer)
        Signer(s.authority, lambda: datetime.now(UTC)).serve(hub, ["tokyo", "paris"])
        while not attempts or (open_to_all and let_through() < expected):  # a busy machine may take longer than an attempt waits
            codes[:] = [await asyncio.to_thread(report, file, True)]
            attempts[:] = json.loads(capsys.readouterr().out)["attempts"]

    secured(tmp_path / "host", body, all_may_ask=open_to_all)
    assert codes == [int(open_to_all)]
    assert len(attempts) == 19 and all(a["stopped"] is not None for a in attempts)
    assert let_through() == expected

"""Somebody breaks what runs. What it needs: the certificate of the hub, which is the host's."""

from __future__ import annotations

from pathlib import Path

import pytest
from secured_bus import Secured, secured

from vistel.v1.service_pb2 import FaultReply, FaultRequest
from vistel.wire.topics import BY_NAME


@pytest.mark.parametrize("all_may_ask", [True, False], ids=["before", "now"])
@pytest.mark.parametrize("name", ["guest", "paris", "world"])
def test_faults_are_struck_by_the_hub_and_by_nobody_else(tmp_path: Path, name: str, all_may_ask: bool) -> None:
    async def body(s: Secured) -> None:
        hub, host, attacker = await s.door("hub"), await s.door("hub"), await s.door(name)
        hub.serve(BY_NAME["fault"], lambda _: FaultReply(struck="kill hub/world"))
        request = FaultRequest(name="kill", target="hub/world")
        while await host.query(BY_NAME["fault"], request) is None:  # until the router knows who answers
            pass
        assert (await attacker.query(BY_NAME["fault"], request, 60.0 if all_may_ask else 1.0) is not None) == all_may_ask

    secured(tmp_path, body, all_may_ask=all_may_ask)

"""What deploy/zenoh holds: configurations a router takes, certificates its rules accept."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime
from pathlib import Path

import pytest
import zenoh

from vistel.v1.motion_pb2 import Participant
from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import ZenohBus
from vistel.wire.zenoh.config import as_text
from vistel.wire.zenoh.deployment import hub_config, main
from vistel.wire.zenoh.endpoints import free_port

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "deploy/zenoh"


@pytest.mark.parametrize(
    ("file", "arguments"),
    [("hub.json5", ["hub", "demo", "tokyo", "columbus"]), ("site.json5", ["site", "tls/hub.example.org:7447", "tokyo"])],
)
def test_the_committed_configurations_are_what_the_code_gives_and_zenoh_takes_them(file: str, arguments: list[str]) -> None:
    text = (FOLDER / file).read_text()
    assert text == main(arguments), f"python -m vistel.wire.zenoh.deployment {' '.join(arguments)} > deploy/zenoh/{file}"
    zenoh.Config.from_json5(text)


def test_certificates_of_the_authority_are_those_with_which_a_site_joins_a_hub_without_python(tmp_path: Path) -> None:
    authority = Authority.create(tmp_path / "c", datetime.now(UTC))
    authority.issue("hub", datetime.now(UTC), hosts=["localhost"])
    for site in ("tokyo", "columbus"):
        authority.issue(site, datetime.now(UTC))
    port = free_port()
    config = hub_config("demo", ["tokyo", "columbus"], tmp_path / "c")
    config["listen"]["endpoints"] = [f"tls/127.0.0.1:{port}"]
    router = zenoh.open(zenoh.Config.from_json5(as_text(config)))

    async def door(site: str) -> ZenohBus:
        files = (f"{tmp_path}/c/ca.pem", f"{tmp_path}/c/{site}.pem", f"{tmp_path}/c/{site}.key")
        return await ZenohBus.open(
            conference="demo", site=site, clock=SystemClock(), endpoints=[f"tls/localhost:{port}"], tls=files
        )

    async def run() -> None:
        tokyo, columbus = await door("tokyo"), await door("columbus")
        subscription = columbus.subscribe(BY_NAME["participant"])
        tokyo.publish(BY_NAME["participant"], participant="ann").put(Participant(display_name="Ann"))
        async for sample in subscription:
            assert sample.message.display_name == "Ann"
            break
        await asyncio.gather(tokyo.close(), columbus.close())

    asyncio.run(run())
    router.close()

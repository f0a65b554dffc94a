"""`vistel site router` tells how others join."""

from pathlib import Path

import pytest

from vistel.conference.model import Conference
from vistel_cli.site.router import how_to_join

FILE = Path("office.toml")
SITES = [{"name": name, "participants": [{"name": f"p-{name}"}]} for name in ("tokyo", "columbus")]
ROUTED = {"mode": "routed", "endpoints": ["tcp/hub.example.org:7447"]}


@pytest.mark.parametrize(
    ("bus", "listen", "hub"),
    [
        ({}, "tcp/0.0.0.0:7447", " --hub tcp/192.168.1.7:7447"),
        ({}, "tcp/10.0.0.2:9000", " --hub tcp/10.0.0.2:9000"),
        (ROUTED, "tcp/0.0.0.0:7447", ""),
    ],
)
def test_the_commands_for_world_and_sites_are_printed_with_an_address_that_reaches_the_router(
    bus: dict[str, object], listen: str, hub: str
) -> None:
    conference = Conference.model_validate({"name": "office", "sites": SITES, "bus": bus})
    assert how_to_join(conference, FILE, listen, "192.168.1.7")[1:] == [
        f"vistel site world office.toml{hub}",
        f"vistel site join office.toml tokyo{hub}",
        f"vistel site join office.toml columbus{hub}",
    ]


def test_a_router_that_listens_to_its_own_machine_only_says_so() -> None:
    conference = Conference.model_validate({"name": "office", "sites": SITES})
    assert "certificates" in how_to_join(conference, FILE, "tcp/127.0.0.1:7447", "192.168.1.7")[0]

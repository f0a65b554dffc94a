"""As whom a command takes part in a conference whose certificates tell who this machine is."""

from __future__ import annotations

from pathlib import Path

import pytest

from vistel.conference.files import load
from vistel_cli.conference_choice import chosen_here, joined

FILE = """
name = "office"

[bus]
mode = "routed"
endpoints = ["tls/127.0.0.1:1"]
tls = { folder = "certificates" }

[[sites]]
name = "tokyo"

[[sites.participants]]
name = "aiko"

[[sites]]
name = "columbus"

[[sites.participants]]
name = "ben"
"""


@pytest.mark.parametrize("names", [("hub",), ("columbus",), ("hub", "router")], ids=" ".join)
def test_a_command_shows_the_certificate_that_is_on_this_machine(names: tuple[str, ...], tmp_path: Path) -> None:
    file = tmp_path / "conference.toml"
    file.write_text(FILE)
    (tmp_path / "certificates").mkdir()
    for name in ("ca", *names):
        (tmp_path / "certificates" / f"{name}.key").write_text("")
    assert load(file).sites[0].name not in names
    assert chosen_here(file, None)[2] == joined(file, None)[1] == names[0]

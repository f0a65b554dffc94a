"""Two places of one name, and two files of one conference, are told before anything starts."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path

import pytest
import typer

from vistel.conference.connect import connect, owners_of
from vistel.conference.files import load
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.zenoh.bus import Router
from vistel_cli.site.link import check_link

FILE = """name = "demo"
[[sites]]
name = "tokyo"
participants = [{ name = "aiko" }]
[[sites]]
name = "paris"
participants = [{ name = "ben" }]
"""


def _said(
    folder: Path, capsys: pytest.CaptureFixture[str], *, present: str = "", hubs_file: str = FILE, ends: bool = False
) -> tuple[bool, str]:
    """Whether tokyo may start, and what it is told. present: a token that a tokyo elsewhere shows; ends: and stops showing."""
    for name, text in (("here", FILE), ("hub", hubs_file)):
        (folder / f"{name}.toml").write_text(text)
    here, hubs = load(folder / "here.toml"), load(folder / "hub.toml")

    async def body() -> bool:
        router = Router.open()
        hub = await connect(hubs, "hub", SystemClock(), router.endpoint)
        serve_clock(hub, SystemClock(), owners=owners_of(hubs))
        other = await connect(here, "tokyo", SystemClock(), router.endpoint)
        if present:
            other.announce(present)
        if ends:
            asyncio.get_running_loop().call_later(0.5, lambda: asyncio.ensure_future(other.close()))
        starts = False
        with contextlib.suppress(typer.Exit):
            await asyncio.to_thread(check_link, here, "tokyo", router.endpoint)
            starts = True
        await other.close()
        await hub.close()
        router.close()
        return starts

    return asyncio.run(body()), capsys.readouterr().err


def test_a_site_does_not_start_while_another_place_of_its_name_is_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    starts, said = _said(tmp_path, capsys, present="process-capture")
    assert not starts
    assert "tokyo is in the conference already (capture): one site cannot be in two places" in said


def test_what_is_left_of_a_site_that_died_does_not_keep_it_from_starting(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _said(tmp_path, capsys, present="process-capture", ends=True) == (True, "")


def test_who_asks_something_as_a_site_is_no_second_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _said(tmp_path, capsys) == (True, "")


@pytest.mark.parametrize(
    ("change", "names"),
    [
        (('name = "ben"', 'name = "bob"'), "paris"),
        (('[{ name = "aiko" }]', '[{ name = "aiko" }, { name = "carla" }]'), "tokyo"),
        (('name = "paris"', 'name = "lima"'), "lima, paris"),
    ],
)
def test_a_conference_file_that_differs_from_the_hubs_is_told_with_the_sites_it_differs_in(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: tuple[str, str], names: str
) -> None:
    starts, said = _said(tmp_path, capsys, hubs_file=FILE.replace(*change))
    assert starts
    assert f"give other people or devices to {names}; what only one of them knows is not heard" in said.replace("\n", " ")

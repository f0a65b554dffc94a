"""`vistel invite`: links for the seats of a running conference's guests."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from vistel.conference.invitations import RefusedError, invitations_in, invited
from vistel.conference.running import Running, announced
from vistel_cli.main import app

FILE = Path(__file__).parents[3] / "examples/conferences/guests.toml"


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    folder = tmp_path / "run"
    folder.mkdir()
    with announced(Running("guests", "tcp/127.0.0.1:9", str(FILE), "out", 1, run=str(folder), console="https://127.0.0.1:8440/")):
        yield folder


def said(*words: str, code: int = 0) -> str:
    done = CliRunner().invoke(app, ["invite", *words], env={"COLUMNS": "300"})
    assert done.exit_code == code, done.output
    return done.output


def test_links_fill_the_seats_in_order_and_a_new_one_takes_the_place_of_the_old(run: Path) -> None:
    told = [json.loads(said(name, "--host", "meet.example.org", "--json")) for name in ("Ann", "Bob", "Ann")]
    assert [t["seat"] for t in told] == ["guest-1", "guest-2", "guest-1"]
    pages, tokens = zip(*(t["link"].split("#") for t in told), strict=True)
    assert set(pages) == {"https://meet.example.org:8440/join"} and len(set(tokens)) == 3
    known = invitations_in(run)
    now_ns = min(i.until_ns for i in known) - 1
    assert invited(known, tokens[2], now_ns).name == "Ann" and invited(known, tokens[1], now_ns).participant == "guest-2"
    assert not any(token in (run / "invitations.json").read_text() for token in tokens)
    for token, at_ns in ((tokens[0], now_ns), (tokens[2], known[-1].until_ns)):
        with pytest.raises(RefusedError):
            invited(known, token, at_ns)
    assert "all seats for guests are taken, by Bob, Ann" in said("Cas", code=1)
    assert "counts no more" in said("Bob", "--revoke")
    assert "is not invited" in said("Bob", "--revoke", code=2)
    said("Cas", "--person", "ines", "--hours", "0.5")
    assert invitations_in(run)[-1].avatar == "builtin:person=ines"


def test_of_several_conferences_the_newest_with_seats_for_guests_is_meant(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with contextlib.ExitStack() as others:
        for n, (name, file) in enumerate((("den", FILE.with_name("den.toml")), ("gone", tmp_path / "gone.toml"))):
            newer = Running(name, "tcp/127.0.0.1:9", str(file), "out", 2 + n, run=str(tmp_path / name))
            with monkeypatch.context() as patch:
                patch.setattr(os, "getpid", lambda n=n: n)  # a conference is listed by its process
                others.enter_context(announced(newer))
        assert json.loads(said("Ann", "--json"))["seat"] == "guest-1"
    assert [i.name for i in invitations_in(run)] == ["Ann"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("Ann", "--seat", "aiko"), "--seat: expected one of guest-1, guest-2, got 'aiko'"),
        (("Ann", "--hours", "1000"), "--hours: expected a number from 0.01 to 720"),
        (("Ann", "--person", "nobody"), "--person: avatar"),
        (("A" * 41,), "name: expected 1 to 40 letters"),
        (("",), "name: expected 1 to 40 letters"),
        (("A\nnn",), "name: expected 1 to 40 letters"),
    ],
)
def test_what_cannot_be_invited_gets_one_line(run: Path, words: tuple[str, ...], says: str) -> None:
    assert says in said(*words, code=2)
    assert invitations_in(run) == []

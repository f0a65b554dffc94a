"""Every command the documentation shows is one the program understands; every link leads somewhere."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import click
import pytest
import typer

from vistel.conference.model import Conference
from vistel_cli.main import app

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", *ROOT.glob("docs/**/*.md")])


def _commands() -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    for page in PAGES:
        text = page.read_text("utf-8")
        lines = [line.strip() for line in text.splitlines() if line.startswith("    ")]
        lines += re.findall(r"`((?:\.venv/bin/)?vistel [^`]*)`", text)
        for line in lines:
            command = re.sub(r"\s+#.*$", "", line)
            if re.match(r"(\.venv/bin/)?vistel ", command) and "…" not in command:
                found.append((page.relative_to(ROOT).as_posix(), command))
    return found


@pytest.mark.parametrize(("page", "command"), _commands())
def test_a_documented_command_parses(page: str, command: str, tmp_path: Path) -> None:
    words = shlex.split(command)[1:]
    _parse(typer.main.get_command(app), words)


def _parse(command: click.Command, words: list[str]) -> None:
    context = command.make_context(command.name or "vistel", list(words), resilient_parsing=False)
    if isinstance(command, click.Group):
        name, child, rest = command.resolve_command(context, [*context.protected_args, *context.args])
        assert child is not None, name
        _parse(child, rest)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)", page.read_text("utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_the_conference_file_reference_shows_a_valid_file_with_every_default() -> None:
    text = (ROOT / "docs/reference/conference-file.md").read_text("utf-8")
    shown = tomllib.loads(re.findall(r"```toml\n(.*?)```", text, re.DOTALL)[0])
    conference = Conference.model_validate(shown)
    bare = Conference.model_validate(
        {"sites": [{"name": "tokyo", "participants": [{"name": "aiko", "display_name": "Aiko"}], "props": [{"thing": "baton"}]}]}
    )
    assert conference == bare

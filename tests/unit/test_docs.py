"""Every command the documentation shows is one the program understands; every link leads somewhere."""

from __future__ import annotations

import pkgutil
import re
import shlex
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.core import TyperGroup
from typer.exceptions import TyperException

from vistel.conference.model import Conference
from vistel_cli.main import app

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("README*.md"), *ROOT.glob("docs/**/*.md")])


def _commands() -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    for page in PAGES:
        text = page.read_text("utf-8")
        lines = [line.strip() for line in text.splitlines() if line.startswith("    ")]
        lines += re.findall(r"`((?:\.venv/bin/)?vistel [^`]*)`", text)
        for line in lines:
            command = re.sub(r"(\s+#|\s{3}).*$", "", line)
            if re.match(r"(\.venv/bin/)?vistel ", command) and "…" not in command:
                found.append((page.relative_to(ROOT).as_posix(), command))
    return found


@pytest.mark.parametrize(("page", "command"), _commands())
def test_a_documented_command_parses(page: str, command: str, tmp_path: Path) -> None:
    words = shlex.split(command)[1:]
    try:
        _parse(typer.main.get_command(app), words)
    except typer.Exit:  # --version has been printed
        pass
    except TyperException as e:  # a sentence may name a command without its arguments
        assert type(e).__name__ in ("MissingParameter", "NoArgsIsHelpError"), e
        assert f"`{command}`" in (ROOT / page).read_text("utf-8")


def _parse(command: Any, words: list[str]) -> None:
    context = command.make_context(command.name or "vistel", list(words), resilient_parsing=False)
    if isinstance(command, TyperGroup) and (words or not command.invoke_without_command):
        name, child, rest = command.resolve_command(context, [*context._protected_args, *context.args])
        assert child is not None, name
        _parse(child, rest)


def test_no_two_how_tos_write_files_of_the_same_name() -> None:
    """Somebody who tries one page after the other in one folder would be refused: the file exists."""
    writers: dict[str, set[str]] = {}
    for page, command in _commands():
        for name in re.findall(r" (?:-o|--out|--heights|--bumps|--sheet|--picture) (\S*[a-z]\S*)", command):
            if page.startswith("docs/how-to/"):
                # An OBJ has a picture of its name beside it.
                kept = Path(name).stem if name.endswith((".obj", ".png")) else name
                writers.setdefault(kept, set()).add(page)
    assert {name: pages for name, pages in writers.items() if len(pages) > 1} == {}


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)", page.read_text("utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_to_part_of_a_page_lead_to_a_heading_there(page: Path) -> None:
    for target, part in re.findall(r"\]\(([^)#:]*)#([^)]+)\)", page.read_text("utf-8")):
        headings = re.findall(r"^#+ (.*)$", (page.parent / target if target else page).read_text("utf-8"), re.MULTILINE)
        assert part in {re.sub(r"[^\w\- ]", "", heading).lower().replace(" ", "-") for heading in headings}, f"{target}#{part}"


def test_the_conference_file_reference_shows_a_valid_file_with_every_default() -> None:
    text = (ROOT / "docs/reference/conference-file.md").read_text("utf-8")
    shown = tomllib.loads(re.findall(r"```toml\n(.*?)```", text, re.DOTALL)[0])
    conference = Conference.model_validate(shown)
    bare = Conference.model_validate(
        {"sites": [{"name": "tokyo", "participants": [{"name": "aiko", "display_name": "Aiko"}], "props": [{"thing": "baton"}]}]}
    )
    assert conference == bare


NAMES = re.compile(r"`((?:vistel|vistel_services|vistel_sim|vistel_cli)(?:\.[a-zA-Z_]\w*)+)`")
PATHS = re.compile(r"`((?:vistel|services|sim|clients|proto|examples|benchmarks|scripts|tests|docs|deploy)/[\w./-]+)`")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_every_name_and_path_of_the_code_on_a_page_exists(page: Path) -> None:
    text = page.read_text("utf-8")
    for name in sorted(set(NAMES.findall(text))):
        if not name.endswith((".toml", ".py")):
            pkgutil.resolve_name(name)
        # Keys of the bus look like paths: vistel/CONFERENCE/...
    paths = [p for p in PATHS.findall(text) if not p.startswith("vistel/") or (ROOT / Path(*Path(p).parts[:2])).exists()]
    assert [p for p in sorted(paths) if not (ROOT / p).exists()] == []


def _sources() -> dict[str, str]:
    """Text of every file of the repository, by path."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    found: dict[str, str] = {}
    for name in filter(None, listed.split("\0")):
        data = (ROOT / name).read_bytes() if (ROOT / name).is_file() else b"\0"
        if b"\0" not in data:
            found[name] = data.decode("utf-8")
    return found


def test_every_citation_of_the_mathematics_has_a_target() -> None:
    page = (ROOT / "docs/explanation/mathematics.md").read_text("utf-8")
    equations = re.findall(r"^\*\*M(\d+)\.(\d+) ", page, re.MULTILINE)
    sections = re.findall(r"^## M(\d+) ", page, re.MULTILINE)
    numbers = [(int(section), int(equation)) for section, equation in equations]
    assert numbers == sorted(set(numbers))
    targets = {f"M{section}.{equation}" for section, equation in numbers} | {f"M{section}" for section in sections}
    lost = {
        (path, cited)
        for path, text in _sources().items()
        for citation in re.findall(r"mathematics((?:[\s,#/]|and|to|M\d+(?:\.\d+)?)*)", text)
        for cited in re.findall(r"M\d+(?:\.\d+)?", citation)
        if cited not in targets
    }
    assert lost == set()


def test_nothing_cites_what_is_not_in_the_repository() -> None:
    elsewhere = re.compile("spec" + r"_maths|\bspec §|\(E\d+\)|\berrat(um|a) E\d")
    assert [path for path, text in _sources().items() if elsewhere.search(text)] == []

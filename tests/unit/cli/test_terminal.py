"""What the command prints is plain text: names and paths of users are never read as markup."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from rich.table import Table
from typer.testing import CliRunner

import vistel_cli
from vistel.wire.log import LogWriter
from vistel_cli import terminal
from vistel_cli.main import app

TRICKY = ("out/[x]/a.mcap", "[bold]", "[/]", "a[/red]", "\\[x]", "x\\", ":smile:", "[link=file:///]a[/link]")


@pytest.mark.parametrize("text", TRICKY)
def test_a_text_is_printed_as_it_is(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    terminal.out.print(text)
    terminal.print_warning(text)
    terminal.print_error(text)
    printed = capsys.readouterr()
    assert printed.out == f"{text}\n"
    assert printed.err == f"{text}\nerror: {text}\n"


def test_a_long_text_goes_on_below_its_beginning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terminal, "_columns", lambda _: None)  # as on a terminal
    monkeypatch.setattr(terminal.out, "width", 70)
    text = "neither DISPLAY nor WAYLAND_DISPLAY is set → no windows"
    assert terminal.indented(text, 24) == f"neither DISPLAY nor WAYLAND_DISPLAY is set →\n{' ' * 24}no windows"
    monkeypatch.setattr(terminal.out, "width", 1000)
    assert terminal.indented(text, 24) == text


@pytest.mark.parametrize("text", TRICKY)
def test_a_cell_of_a_table_is_printed_as_it_is(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    table = Table(text, box=None, padding=0)
    table.add_row(text)
    terminal.out.print(table)
    assert [line.rstrip() for line in capsys.readouterr().out.splitlines()] == [text] * 2


def test_a_path_with_brackets_stays_whole_in_what_a_command_prints(tmp_path: Path) -> None:
    folder = tmp_path / "[x]"
    folder.mkdir()
    LogWriter(folder / "a.mcap", conference="").close()
    done = CliRunner().invoke(app, ["log", "cut", str(folder / "a.mcap"), "--out", str(folder / "[bold]b.mcap")])
    assert done.exit_code == 0, done.output
    assert f"written to {folder / '[bold]b.mcap'}" in done.stdout


def test_nothing_in_the_command_but_its_help_is_markup() -> None:
    tag = re.compile(r"\[/?(bold|dim|red|green|yellow)\]|\[/\]|rich\.markup|Console\(")
    help_only = re.compile(r"\[bold\](Examples?|Commands)\[/bold\]")
    for file in Path(vistel_cli.__file__).parent.rglob("*.py"):
        if file.name != "terminal.py":
            left = tag.search(help_only.sub("", file.read_text("utf-8")))
            assert left is None, f"{file}: {left}"


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_a_terminal_that_is_not_utf_8_gets_what_it_can_show(encoding: str) -> None:
    command = [sys.executable, "-m", "vistel_cli.main", "speech", "grammar", "--read", "あかいはこ"]
    done = subprocess.run(command, check=False, capture_output=True, env=os.environ | {"PYTHONIOENCODING": encoding})
    said = (done.stdout + done.stderr).decode(encoding)
    assert "unexpected" not in said and "?????" in said


def test_ctrl_c_while_the_command_loads_ends_it_without_a_word() -> None:
    script = """import os, signal, sys
class Interrupting:
    def find_spec(self, name, path, target=None):
        if name == "typer":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupting())
from vistel_cli.start import main
main()"""
    done = subprocess.run([sys.executable, "-c", script], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")

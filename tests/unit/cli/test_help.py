"""The help of the command: square brackets in its texts reach the terminal."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
from rich.markup import render
from typer.core import TyperGroup
from typer.testing import CliRunner

from vistel_cli.lazy import every_command
from vistel_cli.main import app
from vistel_cli.terminal import print_error

STYLES = re.compile(r"\[/?(bold|dim)\]")


FOLDERS = (
    "run",
    "voice",
    "world",
    "devices",
    "log",
    "avatar",
    "wrinkle",
    "calibrate",
    "scene",
    "examples",
    "faults",
    "studio",
    "testing",
)
EVERY = dict(every_command(typer.main.get_command(app), "vistel"))
OF_OTHERS = {"numpy", "numba", "zenoh", "pydantic", "google.protobuf", "cv2", "pxr", "av", "PIL", "scipy", "aiohttp", "psutil"}


def modules_after(*words: str) -> set[str]:
    """What a fresh Python has imported after `vistel WORDS`."""
    script = """import sys
from vistel_cli.lazy import every_command
from vistel_cli.main import app
try:
    app(sys.argv[1:], standalone_mode=False)
except SystemExit:
    pass
print("modules", *sys.modules)"""
    done = subprocess.run([sys.executable, "-c", script, *words], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split()[1:])


def first_paragraph(text: str) -> str:
    return " ".join(text.split("\n\n", maxsplit=1)[0].split())


def test_the_list_of_commands_imports_none_of_them() -> None:
    seen = modules_after("--help")
    own = {m for m in seen if m.startswith(("vistel.", "vistel_cli.", "vistel_s"))}
    assert own <= {
        "vistel_cli.main",
        "vistel_cli.lazy",
        "vistel_cli.plain_values",
        "vistel_cli.terminal",
        *(f"vistel_cli.{f}" for f in FOLDERS),
    }
    assert seen & OF_OTHERS == set()


@pytest.mark.parametrize(
    ("command", "most"), [("up", 430), ("ask", 430), ("log", 300), ("trace", 250), ("avatar", 130), ("world", 170)]
)
def test_a_command_imports_only_its_own_room(command: str, most: int) -> None:
    more = modules_after(command, "--help") - modules_after("--help")
    assert len(more) <= most, sorted(more)
    assert not more & {"numba", "cv2", "pxr", "av", "scipy"}


def test_asking_the_world_loads_no_mathematics_and_no_conference_files() -> None:
    script = "import sys, vistel_cli.ask, vistel.session.asking, vistel.space.commands.phrase; print(*sys.modules)"
    seen = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()
    assert not {"numpy", "pydantic", "vistel.conference.model"} & set(seen)


def test_the_list_of_commands_says_what_each_command_says_of_itself() -> None:
    for path, command in EVERY.items():
        names = command.list_commands(None) if isinstance(command, TyperGroup) else ()
        for name in names:
            listed = command.commands[name].help
            assert listed and first_paragraph(listed) == first_paragraph(EVERY[f"{path} {name}"].help)


@pytest.mark.parametrize("path", EVERY)
def test_every_command_shows_its_help_with_an_example(path: str) -> None:
    shown = CliRunner().invoke(app, [*path.split()[1:], "--help"])
    assert shown.exit_code == 0
    assert hasattr(EVERY[path], "commands") or f"{path} " in shown.output.split("Example", 1)[1]


@pytest.mark.parametrize("command", ["", "up", "ask", "world export"])
def test_a_flag_is_shown_without_a_type(command: str) -> None:
    shown = CliRunner().invoke(app, [*command.split(), "--help"]).output
    assert "--help" in shown
    assert "<bool>" not in shown


def test_no_square_bracket_of_a_help_text_vanishes_as_markup() -> None:
    found = [(path, command.help or "") for path, command in EVERY.items()]
    found += [(f"{path} {p.name}", getattr(p, "help", None) or "") for path, command in EVERY.items() for p in command.params]
    assert len(found) > 100
    lost = [where for where, text in found if render(text).plain != STYLES.sub("", text).replace("\\[", "[").replace("\b", "")]
    assert lost == []


def test_an_error_keeps_its_square_brackets(capsys: Any) -> None:
    print_error("name certificates under [bus.tls]")
    assert capsys.readouterr().err == "error: name certificates under [bus.tls]\n"


def test_ctrl_c_ends_a_command_whose_module_loses_it(tmp_path: Path) -> None:
    (tmp_path / "losing.py").write_text(
        "import os, signal\ntry:\n    os.kill(os.getpid(), signal.SIGINT)\nexcept KeyboardInterrupt:\n    pass\n"
        "def run() -> None:\n    print('goes on')\n"
    )
    script = "from vistel_cli.lazy import Lazy\nLazy('losing:run').load('run')()"
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "goes on" not in done.stdout
    assert done.stderr.splitlines()[-1] == "KeyboardInterrupt"


@pytest.mark.parametrize("path", EVERY)
def test_what_is_said_of_an_example_is_a_comment(path: str) -> None:
    examples = [line.strip() for line in (EVERY[path].help or "").splitlines() if line.strip().startswith("vistel ")]
    assert [line for line in examples if re.search(r"\S {2,}(?!#)\S", line)] == []

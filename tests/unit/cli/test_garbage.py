"""Whatever a command is given, it answers with one line per fault and an exit code, never with a traceback.

All commands are found by walking the app, so that a new one is in the test by itself.
"""

from __future__ import annotations

import inspect
import random
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
import typer

from vistel_cli.inputs import parameters
from vistel_cli.kind_of_file import FOLDER, PICTURE, kind_of_file
from vistel_cli.lazy import every_command
from vistel_cli.main import app
from vistel_cli.unexpected import tell

ROOT = Path(__file__).parents[3]
NO_FILE = "no [such] file"
RIGHT_KIND = ("broken TOML", *(f"head.{ending}" for ending in ("mcap", "usdc", "glb", "usda", "bvh")))
"""Garbage that only reading it whole shows to be such."""


@cache
def vistel() -> Any:
    return typer.main.get_command(app)


@cache
def commands() -> dict[str, Any]:
    return {path: c for path, c in every_command(vistel(), "vistel") if not hasattr(c, "commands")}


def paths_of(command: Any) -> list[Any]:
    """The parameters of a command that are files."""
    hints = get_type_hints(inspect.unwrap(command.callback), include_extras=True)
    takes = parameters(command.callback)
    return [p for p in command.params if takes.get(p.name) or Path in _flat(hints.get(p.name))]


def _flat(hint: Any) -> set[Any]:
    return {hint} | {t for inner in get_args(hint) for t in _flat(inner)}


def words(command: Any, given: dict[str, str]) -> list[str]:
    """A command line with `given`, and some word for whatever else is required; options come first."""
    out: list[str] = []
    for p in sorted(command.params, key=lambda p: not p.opts[-1].startswith("-")):
        if p.name in given or p.required:
            endings = re.findall(r"\.(\w+)|(USD|PNG|MCAP)", p.help or "")
            value = given.get(p.name, f"new.{''.join(endings[0]).lower().replace('usd', 'usda')[:4]}" if endings else "1")
            out += [p.opts[-1], value] if p.opts[-1].startswith("-") else [value]
    return out


def garbage(folder: Path) -> Iterator[tuple[str, Path]]:
    """Files that no command can want, by what they are."""
    yield "missing", folder / NO_FILE
    (folder / "empty.toml").touch()
    yield "empty", folder / "empty.toml"
    (folder / "a folder").mkdir()
    yield "folder", folder / "a folder"
    dice = random.Random(7)
    for ending in ("toml", "mcap", "usda", "glb", "obj", "bvh", "wav", "npz", "csv", "json", "mp4", "png"):
        (folder / f"bytes.{ending}").write_bytes(dice.randbytes(3000))
        yield f"bytes.{ending}", folder / f"bytes.{ending}"
    magic = {"mcap": b"\x89MCAP0\r\n", "usdc": b"PXR-USDC", "glb": b"glTF", "usda": b"#usda 1.0\n", "bvh": b"HIERARCHY\n"}
    for ending, head in magic.items():
        (folder / f"head.{ending}").write_bytes(head + dice.randbytes(3000))
        yield f"head.{ending}", folder / f"head.{ending}"
    (folder / "broken.toml").write_text("[[sites]\nname = ")
    yield "broken TOML", folder / "broken.toml"
    (folder / "conference.toml").write_text("[[sites]]\nname = 3\nparticipants = 'nobody'\n")
    yield "faulty conference", folder / "conference.toml"
    (folder / "scene.toml").write_text("camera = 3\n[shapes.x]\nkind = 'y'\n")
    yield "faulty scene", folder / "scene.toml"
    yield "picture", next(ROOT.glob("tests/looks/golden/*.png"))


def answer(path: str, arguments: list[str], capsys: pytest.CaptureFixture[str], *codes: int) -> str:
    """What a command says of arguments that it cannot take. codes: with which it may end, 1 for a file, 2 (without any) for wrong
    usage."""
    line = f"{path} {' '.join(arguments)}"
    with pytest.raises(SystemExit) as end:
        vistel().main([*path.split()[1:], *arguments], prog_name="vistel")
    told = " ".join("".join(capsys.readouterr()).split())
    assert end.value.code in (codes or (2,)), (line, end.value.code, told)
    assert "Traceback" not in told and "pydantic" not in told, (line, told)
    assert "error" in told.lower() and "╭" not in told, (line, told)
    return told


@pytest.mark.parametrize("path", sorted(commands()))
def test_a_file_that_is_garbage_is_named_in_one_line(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    command = commands()[path]
    takes = parameters(command.callback)
    files = [p for p in paths_of(command) if takes.get(p.name)]
    unmarked = [p for p in paths_of(command) if p not in files and not p.opts[-1].startswith("-")]
    assert not [p.name for p in unmarked if "to write" not in p.help], "an input file says which kinds it takes: Takes(...)"
    for what, file in garbage(tmp_path):
        for p in files:
            if kind_of_file(file) in (FOLDER, PICTURE) and kind_of_file(file) in takes[p.name].kinds:
                continue
            others = {q.name: str(tmp_path / NO_FILE) for q in files if q.required}
            arguments = words(command, {**others, p.name: str(file)})
            told = answer(path, arguments, capsys, *((1, 2) if what in RIGHT_KIND else (1,)))
            assert file.name in told or what in RIGHT_KIND, (what, arguments, told)


@pytest.mark.parametrize("path", sorted(commands()))
def test_an_absurd_number_is_refused_in_one_line(path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    command = commands()[path]
    hints = get_type_hints(inspect.unwrap(command.callback))
    files = {p.name: "no such file" for p in paths_of(command) if parameters(command.callback).get(p.name)}
    for p in command.params:
        if _flat(hints.get(p.name)) & {int, float}:
            for value in ("nan", "-inf", "x", "", "1e999"):
                arguments = words(command, {**files, p.name: value})
                assert p.opts[-1] in answer(path, arguments, capsys), arguments


@pytest.mark.parametrize("path", sorted(commands()))
def test_a_word_that_a_command_does_not_know_is_refused_in_one_line(path: str, capsys: Any) -> None:
    some = words(commands()[path], {})
    assert "--garbage" in answer(path, ["--garbage", *some], capsys)
    more = answer(path, [*some, *["garbage"] * 5], capsys) if not _takes_many(commands()[path]) else "garbage"
    assert "garbage" in more


def _takes_many(command: Any) -> bool:
    return any(p.nargs == -1 for p in command.params)


KINDS = [
    ("up", "out/conference.mcap", b"\x89MCAP0\r\n", "expected a conference file; this is a log of a conference: vistel log info"),
    ("trace", "den.toml", b"[[sites]]\nname = 'a'", "expected a scene file; this is a conference file: vistel up den.toml"),
    (
        "up",
        "blobs.toml",
        b"[camera]\nposition = [0, 0, 5]",
        "expected a conference file; this is a scene file: vistel trace blobs.toml",
    ),
    (
        "log info",
        "eva.glb",
        b"glTF\2\0\0\0",
        "expected a log of a conference; this is a glTF or VRM file: vistel avatar import eva.glb",
    ),
    ("up", "confrence.toml", None, "confrence.toml: no such file; did you mean conference.toml?"),
    ("up", "tea.toml", None, "tea.toml: no such file; `vistel examples FOLDER` makes one to begin with"),
    ("log import -o tea.mcap", "tea.bvh", None, "tea.bvh: no such file; `vistel examples FOLDER` makes one, recordings/walk.bvh"),
    ("log info", "tea.mcap", None, "tea.mcap: no such file; `vistel up` records one below the folder where you type it"),
]


@pytest.mark.parametrize(("command", "name", "data", "expected"), KINDS, ids=[f"{c} {n}" for c, n, _, _ in KINDS])
def test_another_kind_of_file_is_named_with_what_one_can_do_with_it(
    command: str, name: str, data: bytes | None, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "conference.toml").touch()
    if data is not None:
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_bytes(data)
    assert expected in answer(f"vistel {command}", [name], capsys, 1)


def test_a_misspelt_option_is_answered_with_the_one_that_is_nearest(capsys: Any) -> None:
    said = answer("vistel up", ["--second", "3"], capsys, 2)
    assert "no such option: --second; did you mean --seconds?;" in said


@pytest.mark.parametrize(("word", "meant"), [("mut", "mute or unmute"), ("watsh", "watch")])
def test_a_misspelt_command_is_answered_with_those_that_are_like_it(word: str, meant: str, capsys: Any) -> None:
    said = answer("vistel voice", [word], capsys, 2)
    assert f"no such command '{word}'; did you mean {meant}?;" in said


def test_what_nobody_foresaw_ends_in_one_line_with_a_report(capsys: Any) -> None:
    try:
        raise ExceptionGroup("tasks", [ZeroDivisionError("a [strange] thing")])
    except ExceptionGroup as e:
        assert tell(e) == 1
    told = capsys.readouterr().err
    assert told.startswith("error: unexpected ZeroDivisionError: a [strange] thing; ") and told.count("\n") == 1
    report = Path(told.split("the full report is in ")[1].strip())
    assert "Traceback" in report.read_text("utf-8")
    report.unlink()


def test_a_file_that_cannot_be_written_is_named_without_a_report(capsys: Any) -> None:
    assert tell(OSError(28, "No space left on device", "/full/disk")) == 1
    assert capsys.readouterr().err == "error: /full/disk: No space left on device\n"

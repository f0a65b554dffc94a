"""A benchmark that cannot measure says so in one line and with exit code 1."""

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from benchmarks.figures import bench_posture, grasp_trials
from benchmarks.hearing import rows as hearing
from benchmarks.row import Row
from benchmarks.voices import speech_enrolment
from benchmarks.wire import bench_motion
from vistel_cli import bench
from vistel_cli.main import app


def nothing() -> Iterator[Row]:
    yield from ()


def without_a_program() -> Iterator[Row]:
    yield Row("wire", "case", "metric", "ms", 1.0)
    raise FileNotFoundError(2, "No such file or directory", "povray")


def without_a_package() -> Iterator[Row]:
    import no_such_package  # noqa: F401

    yield from ()


def with_a_program_that_fails() -> Iterator[Row]:
    subprocess.run(["sh", "-c", "echo no display >&2; exit 3"], capture_output=True, text=True, check=True)
    yield Row("wire", "case", "metric", "ms", 1.0)


def without_a_screen() -> Iterator[Row]:
    raise RuntimeError("no OpenGL here")
    yield Row("wire", "case", "metric", "ms", 1.0)


@pytest.mark.parametrize(
    ("run", "said"),
    [
        (nothing, "error: bench wire: nothing could be measured here; what it needs is missing"),
        (without_a_program, "error: bench wire: povray: not here, and needed"),
        (without_a_package, "error: bench wire: the package no_such_package is needed"),
        (with_a_program_that_fails, "error: bench wire: sh -c 'echo no display >&2; exit 3' ended with 3: no display"),
        (without_a_screen, "error: bench wire: no OpenGL here"),
    ],
)
@pytest.mark.parametrize("options", [[], ["--json"]])
def test_what_is_missing_is_one_line(
    run: Callable[[], Any], said: str, options: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench, "_load", lambda name: SimpleNamespace(run=run))
    result = CliRunner().invoke(app, ["bench", "wire", *options])
    assert (result.exit_code, result.stderr.strip()) == (1, said)


def test_grasp_without_its_recordings_says_which_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grasp_trials, "DATA", tmp_path)
    result = CliRunner().invoke(app, ["bench", "grasp"])
    assert (result.exit_code, result.stderr.strip()) == (1, f"error: bench grasp: {tmp_path / 'hand'}: not here, and needed")


@pytest.mark.parametrize(("module", "name"), [(bench_posture, "posture"), (bench_motion, "motion")])
def test_without_its_recordings_a_benchmark_says_which_folder(
    module: ModuleType, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "DATA", tmp_path / "body")
    result = CliRunner().invoke(app, ["bench", name])
    assert result.exit_code == 1 and result.stderr.startswith(f"error: bench {name}: {tmp_path / 'body'}")
    assert result.stderr.strip().endswith(": not here, and needed")


def test_speech_without_its_voices_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speech_enrolment, "missing", lambda: "no voices")
    monkeypatch.setattr(speech_enrolment, "voices", lambda: [])
    monkeypatch.setattr(hearing, "rows", lambda language: nothing())
    result = CliRunner().invoke(app, ["bench", "speech", "--json"])
    assert (result.exit_code, result.stdout) == (1, "")
    assert (
        "speech, enrolment of a voice in Japanese: skipped, no voices" in result.stderr
        and "error: bench speech: nothing could" in result.stderr
    )

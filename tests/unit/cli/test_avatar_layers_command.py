"""`vistel avatar layers`, as docs/explanation/layers.md shows it, and its wrong usage."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from figure_fixture import tube_person
from typer.testing import CliRunner

from vistel.figure.formats.avatar_file import save_avatar
from vistel.implicit.scene import load
from vistel_cli.main import app


@pytest.fixture(scope="module")
def person(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("layers") / "tube.npz"
    save_avatar(tube_person(), out)
    return out


def run(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["avatar", "layers", *words])
    return result.exit_code, result.output


@pytest.mark.parametrize("show", ["skin", "muscles", "bones"])
def test_the_layers_of_an_avatar_become_a_scene(person: Path, tmp_path: Path, show: str) -> None:
    scene = tmp_path / "figure.toml"
    code, said = run(str(person), "-o", str(scene), "--posture", "squat", "--layers", show, "--json")
    assert code == 0, said
    facts = json.loads(said)
    assert facts["bones"] > 50
    assert ("muscles" in facts) == (show != "bones")
    assert load(scene).program is not None


def test_wrong_usage_says_what_was_expected_in_one_line(person: Path, tmp_path: Path) -> None:
    code, said = run(str(person), "-o", str(tmp_path / "x.toml"), "--posture", "asleep")
    assert code == 2
    assert "expected one of t-pose" in said
    code, said = run(str(tmp_path / "nobody.usda"), "-o", str(tmp_path / "x.toml"))
    assert code == 1
    assert "nobody.usda" in said
    code, said = run(str(person), "-o", str(tmp_path / "no" / "x.toml"))
    assert code == 1
    assert "cannot be written" in said
    assert "Traceback" not in said

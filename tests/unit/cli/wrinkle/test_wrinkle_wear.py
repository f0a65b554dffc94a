"""`vistel wrinkle wear`: avatars from files wear wrinkles, and say so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from avatar_fixture import closed_person
from typer.testing import CliRunner

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.formats.usd import load_usd, save_usd
from vistel.wrinkle.wrinkle_sets import sets_in
from vistel_cli.main import app


def _run(*words: str, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["wrinkle", "wear", *words])
    assert result.exit_code == code, result.output
    return result.output


@pytest.fixture(scope="module")
def coarse() -> Avatar:
    whole = closed_person().coarser[-1]
    return replace(whole, albedo=np.ascontiguousarray(whole.albedo[::2, ::2]), coarser=())


@pytest.fixture
def me(coarse: Avatar, tmp_path: Path) -> Path:
    save_usd(coarse, tmp_path / "me.usdc")
    return tmp_path / "me.usdc"


def test_an_avatar_puts_wrinkles_on_says_so_and_takes_them_off(me: Path) -> None:
    assert json.loads(_run(str(me), "--json")) == {"avatar": str(me), "sets": 0}
    said = json.loads(_run(str(me), "face", "--json"))
    assert said["output"] == str(me)
    assert said["regions"] == ["face", "neck"]
    assert next(s.entry.name for s in sets_in(load_usd(me).wrinkles, "me")) == "forehead"
    assert json.loads(_run(str(me), "--json"))["sets"] == said["sets"] > 3
    _run(str(me), "--off")
    assert load_usd(me).wrinkles == ""


def test_regions_that_wear_none_are_reported_and_where_all_are_so_nothing_is_written(coarse: Avatar, tmp_path: Path) -> None:
    plain = replace(coarse, mesh=replace(coarse.mesh, uv=np.full_like(coarse.mesh.uv, 0.5)))
    save_usd(plain, tmp_path / "plain.usdc")
    before = (tmp_path / "plain.usdc").read_bytes()
    said = " ".join(_run(str(tmp_path / "plain.usdc"), "face", code=1).split())
    assert "face: no wrinkles: 100% of it has no texture coordinates" in said
    assert said.count("error:") == 1
    assert "event=" not in said
    assert (tmp_path / "plain.usdc").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "said", "code"),
    [
        (["nowhere.usda", "face"], "nowhere.usda: no such file", 1),
        (["me.usdc", "kilt"], "no wrinkles called 'kilt'", 1),
        (["me.usdc", "face", "--off"], "--off: expected no sets", 2),
        (["me.usdc", "face", "-o", "me.obj"], "expected a name that ends in", 1),
        (["me.usdc", "-o", "you.usda"], "nothing to write", 2),
    ],
)
def test_bad_input_is_reported_in_one_line(
    words: list[str], said: str, code: int, me: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(me.parent)
    found = " ".join(_run(*words, code=code).split())
    assert said in found
    assert found.count("error:") == 1


def test_a_damaged_text_is_reported_in_one_line(coarse: Avatar, tmp_path: Path) -> None:
    save_usd(replace(coarse, wrinkles="[[sets]]\nname = 3\n"), tmp_path / "me.usdc")
    found = " ".join(_run(str(tmp_path / "me.usdc"), code=1).split())
    assert "me.usdc: wrinkles: sets[0].name: is 3" in found

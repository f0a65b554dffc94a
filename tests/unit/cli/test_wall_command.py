"""`vistel wall`: the calibration picture from a conference file."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner

from vistel_cli.main import app

ROOT = Path(__file__).resolve().parents[3]
V_WALL = ROOT / "examples" / "conferences" / "v-wall.toml"


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["wall", *arguments])
    return result.exit_code, result.output


def test_the_picture_has_every_screen_in_its_pixels(tmp_path: Path) -> None:
    code, said = run(str(V_WALL), "-o", str(tmp_path / "wall.png"))
    assert code == 0, said
    assert "2 screens, 1280x480" in said
    with Image.open(tmp_path / "wall.png") as picture:
        assert picture.size == (1280, 480)


def test_a_conference_without_a_wall_and_an_unknown_site_are_reported_in_a_line(tmp_path: Path) -> None:
    plain = tmp_path / "plain.toml"
    plain.write_text('[[sites]]\nname = "tokyo"\n[[sites.participants]]\nname = "aiko"\n')
    for arguments, expected in (
        ((str(plain),), "no site has"),
        ((str(V_WALL), "--site", "columbus"), "columbus has no"),
        ((str(V_WALL), "--site", "mars"), "there are tokyo, columbus, zurich"),
    ):
        code, said = run(*arguments)
        assert code == (2 if "there are" in expected else 1)
        assert expected in " ".join(said.split())


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    code, said = run(str(V_WALL), "-o", str(tmp_path / "file" / "wall.png"))
    assert code == 1
    assert "cannot be written" in " ".join(said.split())


def test_a_wall_that_is_only_shown_is_not_refused_for_a_picture_that_exists(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)
    Path("wall.png").write_text("mine")
    assert "exists already" in run(str(V_WALL))[1]
    assert "exists already" not in run(str(V_WALL), "--show")[1]
    assert Path("wall.png").read_text() == "mine"

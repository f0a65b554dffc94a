"""`vistel wrinkle`: show, draw, trace; what they say of bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from vistel_cli.main import app

ROOT = Path(__file__).resolve().parents[4]
SHEET = ROOT / "examples/wrinkles/sleeve.toml"
PICTURE = next(ROOT.glob("tests/looks/golden/*.png"))


def _run(*words: str, code: int = 0) -> str:
    done = CliRunner().invoke(app, ["wrinkle", *words])
    assert done.exit_code == code, done.output
    return done.output


def test_show_lists_the_taxonomy_and_draws_it(tmp_path: Path) -> None:
    listed = json.loads(_run("show", "--json"))["shapes"]
    assert len(listed) >= 12
    assert "crows_feet" in _run("show")
    out = tmp_path / "two.png"
    _run("show", "knee", "neck", "-o", str(out), "--size", "80")
    assert Image.open(out).size == (160, 160)


def test_draw_writes_texture_heights_and_normals_and_reports_the_loss(tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("texture.png", "heights.png", "normals.png")]
    said = json.loads(
        _run(
            "draw",
            str(SHEET),
            "-o",
            str(paths[0]),
            "--heights",
            str(paths[1]),
            "--bumps",
            str(paths[2]),
            "--size",
            "200",
            "--limit",
            "1",
            "--json",
        )
    )
    assert (said["width"], said["height"]) == (131, 200)
    assert said["moved_mm"] == pytest.approx(1.0)
    assert said["limited"] is True
    assert [Image.open(p).mode for p in paths] == ["RGB", "I;16", "RGB"]
    heights = np.asarray(Image.open(paths[1])).astype(int)
    assert heights[0, 0] == 32768
    assert heights.max() == 65535


def test_the_map_is_as_large_as_the_texture(tmp_path: Path) -> None:
    Image.new("RGB", (68, 104), (90, 120, 160)).save(tmp_path / "cloth.png")
    (tmp_path / "sheet.toml").write_text(SHEET.read_text().replace("wraps = true", 'wraps = true\ntexture = "cloth.png"'))
    said = json.loads(_run("draw", str(tmp_path / "sheet.toml"), "-o", str(tmp_path / "out.png"), "--json"))
    assert (said["width"], said["height"]) == (68, 104)


def test_a_texture_of_another_form_is_reported(tmp_path: Path) -> None:
    Image.new("RGB", (90, 90)).save(tmp_path / "cloth.png")
    (tmp_path / "sheet.toml").write_text(SHEET.read_text().replace("wraps = true", 'wraps = true\ntexture = "cloth.png"'))
    said = _run("draw", str(tmp_path / "sheet.toml"), "-o", str(tmp_path / "out.png"), code=1)
    assert "texture: is 90 x 90, the displacement map" in " ".join(said.split())


def test_trace_makes_a_shape_that_show_can_draw(tmp_path: Path) -> None:
    _run("draw", str(SHEET), "-o", str(tmp_path / "photo.png"), "--size", "500")
    said = json.loads(_run("trace", str(tmp_path / "photo.png"), "-o", str(tmp_path / "Mine 2.toml"), "--json"))
    assert said["name"] == "mine_2"
    assert said["curves"] >= 3
    _run("show", str(tmp_path / "Mine 2.toml"), "-o", str(tmp_path / "mine.png"), "--size", "64")


@pytest.mark.parametrize(
    ("words", "said", "code"),
    [
        (["show", "kilt"], "no wrinkle shape 'kilt'", 1),
        (["draw", "nowhere.toml", "-o", "x.png"], "nowhere.toml: no such file", 1),
        (["draw", str(SHEET)], "nothing to write", 2),
        (["draw", str(SHEET), "-o", "/nowhere/x.png", "--size", "32"], "cannot be written", 1),
        (["trace", "nowhere.png", "-o", "x.toml"], "nowhere.png: no such file", 1),
        (["trace", str(SHEET), "-o", "x.toml"], "expected a picture; this is a sheet of wrinkles", 1),
        (["trace", str(PICTURE), "-o", "x.txt"], "expected a name that ends in .toml", 1),
    ],
)
def test_bad_input_is_reported_in_one_line(words: list[str], said: str, code: int) -> None:
    found = " ".join(_run(*words, code=code).split())
    assert said in found
    assert found.count("error:") == 1


LINE = "[[branches]]\npoints = [{ at = [-0.9, 0.0] }, { at = [0.9, 0.0] }]\n"
ACROSS = "[[branches]]\npoints = [{ at = [-0.9, -0.5] }, { at = [0.9, 0.5] }]\n"
OFF = 'size = [0.2, 0.2]\n[[wrinkles]]\nshape = "twist"\nat = [0.95, 0.5]\nsize = 0.05\nthickness = 0.01\nintensity = 0.005\n'


@pytest.mark.parametrize(
    ("command", "text", "said"),
    [
        ("show", f'name = "x"\n{LINE}{ACROSS}', "bad.toml: branches[0] and branches[1] cross at"),
        ("show", 'name = "x"\n[[branches]]\npoints = [{ at = [-0.9, 0.0] }, { at = [1.9, 0.0] }]\n', "bad.toml:3: branches[0]"),
        ("show", f'name = "x"\n{LINE}'[:40], "not valid TOML"),
        ("draw", OFF, "wrinkles[0]: leaves the texture at"),
        ("draw", OFF[:-12], "not valid TOML"),
    ],
)
def test_a_file_that_cannot_be_used_is_reported_by_its_name_and_place(command: str, text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(text)
    found = _run(command, str(tmp_path / "bad.toml"), "-o", str(tmp_path / "x.png"), code=1)
    assert "bad.toml" in found and said in " ".join(found.split())
    assert found.count("error:") == 1
    assert not (tmp_path / "x.png").exists()

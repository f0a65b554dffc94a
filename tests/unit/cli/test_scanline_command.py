"""`vistel scanline`: a picture, or one line that says why not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner

from vistel_cli.main import app

RUNNER = CliRunner()
SCENE = """
size = [60, 40]
[camera]
position = [0, 0, 4]
target = [0, 0, 0]
[[lights]]
position = [3, 5, 4]
[shapes.ball]
kind = "sphere"
centre = [0, 0, 0]
radius = 0.8
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    file = tmp_path / "scene.toml"
    file.write_text(SCENE)
    return file


def test_a_scene_becomes_a_picture_and_a_report(scene: Path, tmp_path: Path) -> None:
    picture = tmp_path / "out.png"
    done = RUNNER.invoke(app, ["scanline", str(scene), "-o", str(picture), "--supersample", "2", "--json"])
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert (report["width"], report["height"], report["primitives"]) == (60, 40, 1)
    assert report["implicit_pixels"] > 100
    with Image.open(picture) as image:
        assert image.size == (60, 40)
        corner, middle = image.getpixel((0, 0)), image.getpixel((30, 20))
    assert corner != middle


def test_an_output_that_cannot_be_written_is_refused_before_the_work(scene: Path, tmp_path: Path) -> None:
    done = RUNNER.invoke(app, ["scanline", str(scene), "-o", str(tmp_path / "none" / "out.png")])
    assert done.exit_code == 1
    assert len(done.stderr.strip().splitlines()) == 1 and "there is no folder" in done.stderr


@pytest.mark.parametrize(
    ("changes", "options", "said"),
    [
        ((), ["--size", "8"], "--size"),
        ((), ["--size", "9000x9000", "--supersample", "2"], "--supersample"),
        (('kind = "sphere"', 'kind = "spere"'), [], "shapes"),
    ],
)
def test_what_cannot_be_drawn_is_one_line(
    scene: Path, tmp_path: Path, changes: tuple[str, ...], options: list[str], said: str
) -> None:
    if changes:
        scene.write_text(SCENE.replace(*changes))  # type: ignore[arg-type]
    done = RUNNER.invoke(app, ["scanline", str(scene), "-o", str(tmp_path / "out.png"), *options])
    assert done.exit_code in (1, 2)
    assert len(done.stderr.strip().splitlines()) == 1 and said in done.stderr
    assert not (tmp_path / "out.png").exists()


def test_a_field_that_never_reaches_the_threshold_is_a_warning_and_an_empty_picture(scene: Path, tmp_path: Path) -> None:
    far = '[shapes.far]\nkind = "sphere"\ncentre = [5, 0, 0]\nradius = 0.5\n'
    scene.write_text(SCENE + far + '[shapes.both]\nkind = "intersection"\nof = ["ball", "far"]\n')
    done = RUNNER.invoke(app, ["scanline", str(scene), "-o", str(tmp_path / "out.png"), "--json"])
    assert done.exit_code == 0, done.output
    assert "below the threshold" in done.stderr
    assert json.loads(done.stdout)["implicit_pixels"] == 0


def test_an_object_without_end_is_one_line(scene: Path, tmp_path: Path) -> None:
    scene.write_text(SCENE + '[shapes.hole]\nkind = "complement"\nof = ["ball"]\n')
    done = RUNNER.invoke(app, ["scanline", str(scene), "-o", str(tmp_path / "out.png")])
    assert done.exit_code == 1
    assert "no end" in done.stderr and len(done.stderr.strip().splitlines()) == 1

"""The numbered examples, each run as its reader would."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from PIL import Image
from recorded_meeting import record

pytestmark = pytest.mark.timeout(900)  # where no kernel is compiled yet, the first picture compiles most of them

FOLDER = Path(__file__).parents[2] / "examples"
NUMBERED = sorted(FOLDER.glob("[0-9][0-9]_*"))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Three seconds of the demo's meeting, in a file."""
    return str(record(tmp_path_factory.mktemp("meeting")))


def example(number: int) -> ModuleType:
    (path,) = FOLDER.glob(f"{number:02}_*.py")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def colours(path: Path) -> int:
    """How many different colours a picture has."""
    return len(np.unique(np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3), axis=0))


def test_there_are_twelve_and_each_fits_on_a_screen() -> None:
    assert [int(path.name[:2]) for path in NUMBERED] == list(range(1, 13))
    for path in NUMBERED:
        if path.suffix == ".py":
            assert 15 <= len(path.read_text("utf-8").splitlines()) <= 45, path


def test_a_log_is_opened(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    example(1).main(log)
    printed = capsys.readouterr().out
    assert "aiko, bruno, chidi" in printed
    assert "motion" in printed and "world_state" in printed and "damaged" not in printed


def test_a_motion_becomes_a_table(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    example(2).main(log, "aiko")
    head, *rows = capsys.readouterr().out.splitlines()
    assert head == "t,x,y,z,speed"
    numbers = np.array([[float(x) for x in row.split(",")] for row in rows])
    assert len(numbers) > 20
    assert np.all(np.diff(numbers[:, 0]) >= 0.09)
    assert 0.01 < numbers[:, 4].max() < 5.0


def test_a_thing_is_followed(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    example(3).main(log, "baton")
    assert "baton was carried" in capsys.readouterr().out


@pytest.mark.gl
def test_a_moment_is_drawn(log: str, tmp_path: Path) -> None:
    example(4).main(log, 2.0, str(tmp_path / "moment.png"))
    assert Image.open(tmp_path / "moment.png").size == (640, 360)
    assert colours(tmp_path / "moment.png") > 1000


@pytest.mark.gl
def test_a_figure_is_posed_and_drawn(tmp_path: Path) -> None:
    example(5).main(str(tmp_path / "ben.png"))
    assert colours(tmp_path / "ben.png") > 1000


@pytest.mark.gl
def test_a_figure_travels_through_a_file(tmp_path: Path) -> None:
    example(6).main(str(tmp_path / "carla.glb"), str(tmp_path / "carla.png"))
    assert (tmp_path / "carla.glb").read_bytes()[:4] == b"glTF"
    assert colours(tmp_path / "carla.png") > 1000


def test_a_field_is_blended_and_looked_at(capsys: pytest.CaptureFixture[str]) -> None:
    example(7).main()
    printed = capsys.readouterr().out
    assert "F = 1.050, inside" in printed
    assert "volume 24.15 litres" in printed


def test_a_field_becomes_a_closed_mesh(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example(8).main(str(tmp_path / "dumbbell.obj"))
    assert "watertight: True" in capsys.readouterr().out
    assert (tmp_path / "dumbbell.obj").read_text().count("\nf ") > 5000


def test_a_field_is_traced(tmp_path: Path) -> None:
    example(9).main(str(tmp_path / "pressed.png"))
    assert colours(tmp_path / "pressed.png") > 1000

"""`vistel testing init`: a package whose own tests pass."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner, Result

from vistel_cli.main import app

ROOT = Path(__file__).parents[3]
FILES = {
    *("README.md", "pyproject.toml", ".github/workflows/tests.yml", "tests/test_my_tracker.py"),
    *(f"my_tracker/{name}.py" for name in ("__init__", "protocol", "driver", "simulator")),
}


def init(folder: Path) -> Result:
    return CliRunner().invoke(app, ["testing", "init", str(folder)])


def written(folder: Path) -> dict[str, str]:
    return {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.slow
def test_the_package_is_installed_its_device_is_found_and_its_own_tests_pass(tmp_path: Path) -> None:
    done = init(tmp_path / "My-Tracker")
    assert done.exit_code == 0, done.output
    files = written(tmp_path / "My-Tracker")
    assert files.keys() == FILES
    assert not any("beacon" in text.lower() for text in files.values())
    steps = yaml.safe_load(files[".github/workflows/tests.yml"])["jobs"]["tests"]["steps"]
    assert any("python -m pytest" in step.get("run", "") for step in steps)
    pip = (sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--no-index")
    subprocess.run((*pip, "--target", str(tmp_path / "installed"), str(tmp_path / "My-Tracker")), check=True)
    path = os.pathsep.join([str(tmp_path / "installed"), *(str(ROOT / p) for p in (".", "services", "sim", "clients/cli"))])
    tests = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q"],
        cwd=tmp_path / "My-Tracker",
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert tests.returncode == 0, tests.stdout
    assert "6 passed" in tests.stdout


def test_nothing_is_written_over_and_nothing_is_written_beside_it(tmp_path: Path) -> None:
    folder = tmp_path / "my-tracker"
    folder.mkdir()
    (folder / "README.md").write_text("mine")
    done = init(folder)
    assert done.exit_code == 1
    assert f"{folder}/README.md: exists already; nothing was written" in done.output
    assert written(folder) == {"README.md": "mine"}
    (folder / "README.md").rename(folder / "NOTES.md")
    assert init(folder).exit_code == 0
    assert written(folder).keys() == FILES | {"NOTES.md"}


@pytest.mark.parametrize(
    ("name", "expected", "code"),
    [
        ("json", "a package 'json' is installed already", 2),
        ("fastrak", "VISTEL has a device 'fastrak' of its own", 2),
        ("3d-tracker", "expected a folder whose name can be a package's", 2),
        ("class", "expected a folder whose name can be a package's", 2),
        ("---", "expected a folder whose name can be a package's", 2),
        ("taken/my-tracker", "cannot be written: Not a directory", 1),
    ],
)
def test_what_cannot_be_begun_is_said_in_one_line(tmp_path: Path, name: str, expected: str, code: int) -> None:
    (tmp_path / "taken").write_text("a file")
    done = init(tmp_path / name)
    assert done.exit_code == code
    assert expected in done.output and len(done.output.splitlines()) == 1
    assert written(tmp_path) == {"taken": "a file"}

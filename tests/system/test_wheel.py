"""The package as `make wheel` builds it, in an environment of its own and a folder without the repository."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from waiting import wait_until

import vistel

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]  # kernels are compiled anew, which a busy machine does for long

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("pyproject.toml", "README.md", "LICENSE", "vistel", "services", "sim", "clients/cli")
MOST_BYTES = 30_000_000
CONFERENCE = """name = "small"

[[sites]]
name = "lab"
processes = [["posture"]]

[[sites.participants]]
name = "ada"
"""


class Environment:
    """A folder with nothing in it, and a Python that has the package; the packages that it needs are those of this one."""

    def __init__(self, folder: Path, wheel: Path) -> None:
        self.folder, self.python = folder / "empty", folder / "environment/bin/python"
        self.folder.mkdir()
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", self.python.parents[1]], check=True)
        self.of_user = {**os.environ, "XDG_RUNTIME_DIR": str(folder / "user")}
        # Its packages come first; the .pth file that makes this environment read the repository counts only in this one.
        self.of_user["PYTHONPATH"] = sysconfig.get_path("purelib")
        pip = (sys.executable, "-m", "pip", "--python", str(self.python), "install", "--quiet", "--no-deps", str(wheel))
        subprocess.run(pip, check=True)

    def start(self, *words: str) -> subprocess.Popen[str]:
        """A command in the empty folder."""
        return subprocess.Popen(
            [str(self.python), *words],
            cwd=self.folder,
            env=self.of_user,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )

    def says(self, *words: str) -> str:
        """What a command prints that does what it should."""
        process = self.start(*words)
        said, _ = process.communicate()
        assert process.returncode == 0, said
        return said

    def vistel(self, *words: str) -> str:
        return self.says("-m", "vistel_cli.main", *words)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy, so that nothing is left in the repository."""
    copy = tmp_path_factory.mktemp("wheel")
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
        else:
            shutil.copy(ROOT / name, copy / name)
    build = (sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", "dist", ".")
    subprocess.run(build, cwd=copy, check=True)
    (made,) = (copy / "dist").iterdir()
    return made


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    return Environment(tmp_path_factory.mktemp("user"), wheel)


@pytest.fixture(scope="module")
def compiled(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """As `installed`, with kernels as compiled in the repository: they are of the same files."""
    found = Environment(tmp_path_factory.mktemp("user"), wheel)
    packages = Path(found.says("-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
    for folder, package in ((".", "vistel"), ("sim", "vistel_sim")):
        for kernel in (ROOT / folder / package).rglob("__pycache__/*.nb[ic]"):
            to = packages / kernel.relative_to(ROOT / folder)
            to.parent.mkdir(exist_ok=True)
            shutil.copy(kernel, to)
    return found


def test_it_is_of_pure_python_small_and_of_the_version_that_it_says(wheel: Path, compiled: Environment) -> None:
    assert wheel.name == f"vistel-{vistel.__version__}-py3-none-any.whl"
    assert wheel.stat().st_size < MOST_BYTES
    assert compiled.vistel("--version") == f"vistel {vistel.__version__}\n"
    assert str(ROOT) not in compiled.says("-c", "import vistel; print(vistel.__file__)")


def test_its_examples_are_checked(compiled: Environment) -> None:
    compiled.vistel("examples", "mine", "--no-recording")
    assert "hub/world" in compiled.vistel("up", "mine/conference.toml", "--plan")


@pytest.mark.package
def test_the_doctor_finds_what_it_needs(installed: Environment) -> None:
    assert "found   Python" in installed.vistel("doctor")


@pytest.mark.package
def test_a_conference_runs_and_is_recorded(installed: Environment) -> None:
    (installed.folder / "small.toml").write_text(CONFERENCE)
    up = installed.start("-m", "vistel_cli.main", "up", "small.toml", "--out", "run")
    log = installed.folder / "run/conference.mcap"
    try:
        wait_until(lambda: up.poll() is not None or (log.exists() and log.stat().st_size > 10_000), every_s=0.2)
    finally:
        up.send_signal(signal.SIGINT)
        said, _ = up.communicate()
    assert up.returncode == 0, said
    assert "ada" in installed.vistel("log", "info", "run/conference.mcap")
    installed.vistel("examples", "ours", "--no-recording")
    installed.says("ours/examples/01_open_a_log.py", "run/conference.mcap")


@pytest.mark.package
def test_pytest_finds_its_fixtures(installed: Environment) -> None:
    shutil.copy(ROOT / "examples/test_an_integration/test_my_tracker.py", installed.folder)
    assert "2 passed" in installed.says("-m", "pytest", "-p", "no:cacheprovider", "test_my_tracker.py")


@pytest.fixture(scope="module")
def studied(installed: Environment) -> Environment:
    """The same, after the first tutorial: `out/latest` has a recording of the meeting that the package brings."""
    installed.vistel("up", "--seconds", "20")
    return installed


@pytest.mark.package
def test_the_program_of_the_second_tutorial_measures_the_hands_of_a_recording(studied: Environment) -> None:
    (program,) = programs("first-recording.md")
    (studied.folder / "hands.py").write_text(program)
    said = studied.says("hands.py", "out/latest/conference.mcap", "ben").splitlines()
    assert [line.partition(":")[0] for line in said] == ["left_wrist", "right_wrist"]
    assert all(re.search(r": \d+\.\d m, fastest \d+\.\d\d m/s at \d+\.\d s$", line) for line in said), said


@pytest.mark.package
def test_the_commands_of_the_second_tutorial_study_a_recording(studied: Environment) -> None:
    page = (ROOT / "docs/tutorials/first-recording.md").read_text("utf-8")
    for line in re.findall(r"^    vistel (log .*|replay .*--fast .*)$", page, re.MULTILINE):
        if not line.startswith("log diff "):
            studied.vistel(*shlex.split(line))
    # A slow machine loses frames in the meeting, not in what is computed anew: its exit code says whether that is much.
    compared, _ = studied.start("-m", "vistel_cli.main", *shlex.split(comparison(page))).communicate()
    assert re.search(r"ben: \d+ postures compared", compared) and " s compared: " in compared, compared
    assert (studied.folder / "computed/replay.mcap").exists()
    assert (studied.folder / "ben.glb").stat().st_size > 100_000


@pytest.mark.package
def test_the_program_of_the_third_tutorial_is_tested_fails_and_is_mended(installed: Environment) -> None:
    tracker, place, silence, mended = programs("first-integration.md")
    folder = installed.folder
    (folder / "tracker.py").write_text(tracker)
    (folder / "test_place.py").write_text(place)
    (folder / "test_silence.py").write_text(silence)
    pytest_ = ("-m", "pytest", "-p", "no:cacheprovider")
    assert "1 passed" in installed.says(*pytest_, "test_place.py")
    failed, _ = installed.start(*pytest_, "test_silence.py").communicate()
    assert "IndexError: list index out of range" in failed and "VISTEL kept" in failed
    begin = tracker.rstrip().rpartition("\n")[0]
    (folder / "tracker.py").write_text(f"{begin}\n{mended}")
    assert "2 passed" in installed.says(*pytest_, "test_place.py", "test_silence.py")
    installed.vistel("testing", "check", "fastrak", "sim")


def comparison(page: str) -> str:
    """The command of a tutorial that compares two logs, without `vistel`."""
    (found,) = re.findall(r"^    vistel (log diff .*)$", page, re.MULTILINE)
    return found


def programs(page: str) -> list[str]:
    """What a tutorial tells its reader to save, in order."""
    return re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs/tutorials" / page).read_text("utf-8"), re.MULTILINE | re.DOTALL)

"""The house stands as docs/architecture.md says: arrows one way, short files, time only from clocks."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from scripts import house
from vistel_cli.main import app

ROOT = Path(__file__).resolve().parents[2]


MISSED = {"lines without tests"}
"""Figures of the house that are not met (docs/architecture.md)."""


def test_what_make_house_counts_is_as_wanted_but_for_what_is_known_to_be_missed() -> None:
    assert [(f.name, f.value, f.where) for f in house.figures() if not f.met and f.name not in MISSED] == []


def test_files_of_tests_have_names_of_their_own_without_which_pytest_collects_but_one_of_them() -> None:
    names = Counter(path.name for path in (ROOT / "tests").rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []


def test_import_arrows_run_one_way() -> None:
    command = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_the_library_reads_no_clock_and_no_global_random_generator_outside_the_clock() -> None:
    forbidden = re.compile(
        r"\btime\.(time|monotonic|perf_counter)(_ns)?\(|datetime\.now|\brandom\.(random|seed|randint|choice)"
        r"|np\.random\.(seed|rand|randn|random|uniform|normal|randint)\("
    )
    found = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for path in (ROOT / "vistel").rglob("*.py")
        if path != ROOT / "vistel/wire/clock.py"
        for line in path.read_text("utf-8").splitlines()
        if forbidden.search(line)
    ]
    assert found == []


def test_processes_of_a_conference_join_its_bus_by_its_file_so_that_they_hear_whom_it_knows() -> None:
    allowed = {
        "vistel/wire/zenoh/bus.py",
        "vistel/conference/connect.py",
        "vistel/conference/connect_running.py",
        "clients/cli/vistel_cli/site/router.py",
    }
    files = [f for room in ("vistel", "services", "clients", "sim") for f in (ROOT / room).rglob("*.py")]
    opening = {str(f.relative_to(ROOT)) for f in files if "ZenohBus.open(" in f.read_text("utf-8")}
    assert opening <= allowed, "connect(conference, ...) of vistel.conference.connect"


def test_the_lock_file_names_no_download_address() -> None:
    text = (ROOT / "requirements.lock").read_text()
    assert "://" not in text
    assert "--hash=sha256:" in text


def test_every_dependency_is_locked() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = list(project["dependencies"])
    for extra in project["optional-dependencies"].values():
        wanted += [d for d in extra if not d.startswith("vistel[")]
    lines = [n for n in (ROOT / "requirements.lock").read_text().splitlines() if "==" in n and n[0] != " "]
    locked = {line.split("==")[0].split("[")[0].lower().replace("_", "-") for line in lines}
    names = {re.split(r"[\[<>=!~; ]", d)[0].lower().replace("_", "-") for d in wanted}
    assert names - locked == set()


@pytest.mark.parametrize("service", ["router", "world", "tokyo", "columbus", "recorder"])
def test_compose_services_run_commands_that_exist(service: str) -> None:
    compose = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
    command = compose["services"][service]["command"]
    words = [
        w for w in command if not w.startswith("-") and not w.startswith("/") and "/" not in w and w not in ("tokyo", "columbus")
    ]
    done = CliRunner().invoke(app, [*words, "--help"])
    assert done.exit_code == 0, done.output
    for option in (w for w in command if w.startswith("--")):
        assert option in done.stdout

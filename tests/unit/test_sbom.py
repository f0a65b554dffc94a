"""`make sbom`, `make licences`: what VISTEL is made with; `make audit`: what is known against it."""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from scripts import audit, sbom

ROOT = Path(__file__).resolve().parents[2]
LOCKED = re.findall(r"^([\w.-]+)==", (ROOT / "requirements.lock").read_text(), re.MULTILINE)


def pinned(name: str) -> str:
    """A tool as the Makefile pins it: NAME==VERSION."""
    found = re.search(rf"^{name} := ([\w-]+==[\d.]+)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert found is not None
    return found[1]


def program(folder: Path, name: str, text: str, code: int = 0) -> Path:
    """A program that prints `text`."""
    path = folder / name
    (folder / f"{name}.out").write_text(text)
    path.write_text(f'#!/bin/sh\ncat "{folder / name}.out"\nexit {code}\n')
    path.chmod(0o755)
    return path


@pytest.fixture
def npm_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Makes an npm that prints something."""

    def says(text: str, code: int = 0) -> None:
        program(tmp_path, "npm", text, code)

    monkeypatch.setenv("PATH", os.pathsep.join((str(tmp_path), os.environ["PATH"])))
    says("{}")
    return says


def bill(*components: dict[str, Any]) -> str:
    return json.dumps({"bomFormat": "CycloneDX", "components": list(components)})


def test_a_licence_is_spdx_s_name_or_what_the_package_calls_it_and_never_a_text() -> None:
    said = [
        ([{"license": {"id": "MIT"}}], "MIT"),
        ([{"expression": "Apache-2.0 OR BSD-3-Clause"}], "Apache-2.0 OR BSD-3-Clause"),
        ([{"license": {"name": "License :: OSI Approved :: BSD License"}}], "BSD License"),
        ([{"license": {"name": "BSD\nCopyright somebody\nAll rights"}}], "BSD"),
        ([{"license": {"id": "MIT"}}, {"license": {"name": "declared license of 'x'"}}], "MIT"),
        ([], sbom.UNKNOWN),
    ]
    found = json.loads(bill(*({"name": f"p{n}", "version": "1", "licenses": one} for n, (one, _) in enumerate(said))))
    assert [p.licence for p in sbom.packages("Python", found)] == [wanted for _, wanted in said]


def test_packages_without_a_licence_are_listed_last_and_licences_are_counted(
    tmp_path: Path, npm_says: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    tool = program(tmp_path, "cyclonedx-py", bill({"name": "b", "version": "1"}, {"name": "a", "version": "2", "licenses": []}))
    npm_says(bill({"group": "@types", "name": "c", "version": "3", "licenses": [{"license": {"id": "MIT"}}]}))
    assert sbom.main(["--licences", str(tool), str(tmp_path), str(tmp_path / "sbom")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines[:3]] == [["npm", "@types/c"], ["Python", "a"], ["Python", "b"]]
    assert lines[-2:] == ["   2  not said", "   1  MIT"]


def test_where_npm_fails_python_s_list_is_there_and_one_line_says_why(
    tmp_path: Path, npm_says: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    tool = program(tmp_path, "cyclonedx-py", bill({"name": "a", "version": "1"}))
    npm_says("", code=1)
    assert sbom.main([str(tool), str(tmp_path), str(tmp_path / "sbom")]) == 1
    said = capsys.readouterr()
    assert said.out == f"{tmp_path}/sbom/python.json: 1 packages\n"
    assert said.err == "npm's packages: npm failed: exit code 1\n"
    assert not (tmp_path / "sbom/npm.json").exists()


@pytest.mark.slow
def test_the_pinned_tools_list_what_is_locked_with_licences(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tool = ROOT / ".venv/tools" / pinned("SBOM") / "bin/cyclonedx-py"
    if not tool.exists():
        pytest.skip("cyclonedx-bom is not installed (make sbom)")
    assert sbom.main(["--licences", str(tool), str(ROOT / ".venv"), str(tmp_path)]) == 0
    listed = {line.split()[1].lower().replace("_", "-"): line for line in capsys.readouterr().out.splitlines() if "  " in line[:9]}
    assert {"numpy", "numba", "mcap", "three", "preact"} <= listed.keys()
    assert "Apache-2.0" in listed["numba"] or "BSD" in listed["numba"]
    assert "MIT" in listed["three"]
    assert json.loads((tmp_path / "python.json").read_text())["bomFormat"] == "CycloneDX"


KNOWN = {"name": "numpy", "version": "1.0", "vulns": []}
HURT = {"name": "pillow", "version": "9.0", "vulns": [{"id": "PYSEC-1", "fix_versions": ["9.1"]}]}
FAR = {"name": "numba", "skip_reason": "Dependency not found on PyPI"}
NPM_WELL = json.dumps({"vulnerabilities": {}, "metadata": {"dependencies": {"total": 40}}})
NPM_HURT = json.dumps(
    {
        "vulnerabilities": {"three": {"range": "<1", "via": [{"title": "a hole"}]}, "x": {"range": "*", "via": ["three"]}},
        "metadata": {"dependencies": {"total": 40}},
    }
)


def pip_audit(folder: Path, *packages: dict[str, Any]) -> str:
    return str(program(folder, "pip-audit", json.dumps({"dependencies": packages}), code=1))


def test_an_audit_names_each_vulnerability_and_fails(tmp_path: Path, npm_says: Any, capsys: pytest.CaptureFixture[str]) -> None:
    npm_says(NPM_HURT, code=1)
    assert audit.main([pip_audit(tmp_path, KNOWN, HURT, FAR)]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "pillow 9.0: PYSEC-1, mended in 9.1",
        "three <1 (npm): a hole",
        "audit: 2 known vulnerabilities in 42 packages; `make audit` names them; 1 packages are not known to PyPI's advisories",
    ]


def test_an_audit_that_finds_nothing_is_fine(tmp_path: Path, npm_says: Any, capsys: pytest.CaptureFixture[str]) -> None:
    npm_says(NPM_WELL)
    assert audit.main([pip_audit(tmp_path, KNOWN)]) == 0
    assert capsys.readouterr().out == "audit: no known vulnerabilities in 41 packages\n"


@pytest.mark.parametrize("printed", ["", "no JSON", "[]", json.dumps({"dependencies": [FAR]})])
def test_where_nobody_can_be_asked_one_line_says_so_and_nothing_fails(
    tmp_path: Path, npm_says: Any, capsys: pytest.CaptureFixture[str], printed: str
) -> None:
    npm_says(json.dumps({"error": {"code": "ENOTFOUND"}}), code=1)
    assert audit.main([str(program(tmp_path, "pip-audit", printed, code=1))]) == 0
    assert capsys.readouterr().out == (
        "audit: PyPI's advisories cannot be reached from here; npm's advisories cannot be reached from here\n"
    )


def test_a_check_asks_once_a_day_and_again_when_a_lock_file_changes(
    tmp_path: Path, npm_says: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    lock = tmp_path / "requirements.lock"
    shutil.copy(audit.LOCK, lock)
    monkeypatch.setattr(audit, "LOCK", lock)
    monkeypatch.setattr(audit, "ANSWERED", tmp_path / "answered")
    npm_says(NPM_WELL)
    well, hurt = (
        "audit: no known vulnerabilities in 41 packages",
        "audit: 1 known vulnerabilities in 41 packages; `make audit` names",
    )
    tool = pip_audit(tmp_path, KNOWN)
    assert audit.briefly(tool, 1e9) == well
    pip_audit(tmp_path, HURT)
    assert audit.briefly(tool, 1e9 + 3600.0) == well, "nobody is asked"
    assert audit.briefly(tool, 1e9 + 25 * 3600.0).startswith(hurt)
    pip_audit(tmp_path, KNOWN)
    lock.write_text("numpy==1.0\n")
    assert audit.briefly(tool, 1e9 + 25 * 3600.0) == well


def test_a_check_without_pip_audit_says_so_and_asks_nobody(tmp_path: Path) -> None:
    assert audit.briefly(str(tmp_path / "pip-audit"), 1e9) == "audit: nobody was asked; `make audit` installs pip-audit and asks"


def test_every_tool_is_pinned_exactly_and_is_not_locked_with_vistel() -> None:
    for name in ("SBOM", "AUDIT"):
        tool, _, version = pinned(name).partition("==")
        assert version.count(".") == 2 and tool not in LOCKED

"""Lists what VISTEL is made with, as CycloneDX (`make sbom`), and under which licences (`make licences`).

cyclonedx-py lists the Python packages of an environment, npm those of clients/web that its lock file names; both write what
packages say of themselves. Exit code 1, and one line, where one of the two cannot be run; then the other's list is there.

`python -m scripts.sbom CYCLONEDX-PY ENVIRONMENT FOLDER [--licences]`
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
WEB = ROOT / "clients/web"
UNKNOWN = "not said"


class Package(NamedTuple):
    """of: "Python" or "npm"; licence: as its own metadata say, `UNKNOWN` where they do not."""

    of: str
    name: str
    version: str
    licence: str


def packages(of: str, bill: Any) -> Iterator[Package]:
    """The packages of a bill of materials in CycloneDX's JSON."""
    for component in bill.get("components", []):
        yield Package(of, _name(component), str(component.get("version", "")), _licence(component.get("licenses", [])))


def _name(component: Any) -> str:
    return f"{component['group']}/{component['name']}" if component.get("group") else str(component["name"])


def _licence(said: Sequence[Any]) -> str:
    """SPDX's name or expression where there is one, else what a package calls its licence; never the text of one."""
    found: list[str] = []
    for one in said:
        licence = one.get("license", {})
        name = one.get("expression") or licence.get("id") or licence.get("name", "")
        first = str(name).strip().splitlines()[0][:60] if str(name).strip() else ""
        if first.startswith("License :: "):
            first = first.rpartition(" :: ")[2]
        if first and first not in found and not first.startswith("declared license of"):
            found.append(first)
    return ", ".join(found) or UNKNOWN


def table(found: Sequence[Package]) -> str:
    """A line for each package, those without a licence last, and how many have which."""
    ordered = sorted(found, key=lambda p: (p.licence == UNKNOWN, p.of, p.name.lower()))
    width = max((len(p.name) for p in ordered), default=0)
    lines = [f"{p.of:6}  {p.name:{width}}  {p.version:16}  {p.licence}" for p in ordered]
    counted = Counter(p.licence for p in ordered).most_common()
    return "\n".join([*lines, "", *(f"{count:4}  {licence}" for licence, count in counted)])


def _run(command: Sequence[str], where: Path, what: str) -> str:
    """What a program prints. Raises RuntimeError, one line."""
    try:
        done = subprocess.run(command, cwd=where, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    except OSError as e:
        raise RuntimeError(f"{what}: {command[0]} cannot be run: {e.strerror}") from e
    if done.returncode:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        raise RuntimeError(f"{what}: {Path(command[0]).name} failed: {lines[-1][:200]}")
    return done.stdout


def python_bill(tool: str, environment: str) -> str:
    """Of the packages of a virtual environment. Raises RuntimeError."""
    words = ("environment", environment, "--pyproject", str(ROOT / "pyproject.toml"), "--no-validate", "--of", "JSON", "-o", "-")
    return _run((tool, *words), ROOT, "Python's packages")


def npm_bill() -> str:
    """Of the packages of clients/web, by its lock file. Raises RuntimeError."""
    npm = shutil.which("npm", path=os.pathsep.join((os.environ.get("PATH", ""), str(ROOT / ".venv/bin"))))
    if npm is None:
        raise RuntimeError("npm's packages: there is no npm; `make web` installs it")
    return _run((npm, "sbom", "--package-lock-only", "--sbom-format", "cyclonedx"), WEB, "npm's packages")


def main(words: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="scripts.sbom", description="What VISTEL is made with.")
    parser.add_argument("tool", help="cyclonedx-py")
    parser.add_argument("environment", help="a virtual environment")
    parser.add_argument("folder", type=Path, help="where python.json and npm.json are written")
    parser.add_argument("--licences", action="store_true", help="print a line for each package")
    given = parser.parse_args(words)
    given.folder.mkdir(parents=True, exist_ok=True)
    found: list[Package] = []
    failed = False
    for of, written in (("Python", lambda: python_bill(given.tool, given.environment)), ("npm", npm_bill)):
        path = given.folder / f"{of.lower()}.json"
        path.unlink(missing_ok=True)
        try:
            text = written()
        except RuntimeError as e:
            print(e, file=sys.stderr)
            failed = True
            continue
        path.write_text(text)
        listed = list(packages(of, json.loads(text)))
        found += listed
        if not given.licences:
            print(f"{path}: {len(listed)} packages")
    if given.licences:
        print(table(found))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Asks whether packages that VISTEL locks have known vulnerabilities: pip-audit asks PyPI, npm its registry.

`make audit` names them, and its exit code is 1 if there are any. `make check` says in one line how many there are (`--briefly`). It
asks at most once a day, only where pip-audit is installed, and never fails by it: what becomes known overnight is no fault of the
change that is being checked, and a tree that did not change must not begin to fail. Where nobody can be asked, a line says so.

`python -m scripts.audit PIP-AUDIT [--briefly]`
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "requirements.lock"
WEB = ROOT / "clients/web"
ANSWERED = ROOT / ".venv/.audited"
"""What was last said, of which lock files, when."""
DAY_S = 24 * 3600.0
PATIENCE_S = 180.0
BRIEF_PATIENCE_S = 30.0
"""How long each registry may take in `make check` [s]."""


@dataclass
class Answer:
    """asked, unknown: packages that a registry knows, and does not know; found: a line for each vulnerability; silent: why a
    registry gave no answer."""

    asked: int = 0
    unknown: int = 0
    found: list[str] = field(default_factory=list[str])
    silent: list[str] = field(default_factory=list[str])

    def line(self) -> str:
        """All of it in one line."""
        said: list[str] = []
        if self.asked:
            said.append(f"{len(self.found) or 'no'} known vulnerabilities in {self.asked} packages")
        if self.found:
            said.append("`make audit` names them")
        if self.unknown:
            said.append(f"{self.unknown} packages are not known to PyPI's advisories")
        return "audit: " + "; ".join([*said, *self.silent])


def of_pip_audit(report: Any) -> Answer:
    """The answer in pip-audit's JSON. Where it knows no package at all, PyPI was not reached: it does not say so itself."""
    answer = Answer()
    for package in report.get("dependencies", []):
        if "skip_reason" in package:
            answer.unknown += 1
            continue
        answer.asked += 1
        for one in package.get("vulns", []):
            mended = ", ".join(one.get("fix_versions", [])) or "no version yet"
            answer.found.append(f"{package['name']} {package['version']}: {one['id']}, mended in {mended}")
    if not answer.asked:
        return Answer(silent=["PyPI's advisories cannot be reached from here"])
    return answer


def of_npm_audit(report: Any) -> Answer:
    """The answer in npm's JSON."""
    if "metadata" not in report:
        return Answer(silent=["npm's advisories cannot be reached from here"])
    answer = Answer(asked=int(report["metadata"]["dependencies"]["total"]))
    for name, one in sorted(report.get("vulnerabilities", {}).items()):
        titles = [via["title"] for via in one["via"] if isinstance(via, dict)]
        if titles:
            answer.found.append(f"{name} {one['range']} (npm): {'; '.join(titles)[:160]}")
    return answer


def _report(command: Sequence[str], where: Path, patience_s: float) -> Any:
    """The JSON that a program prints, whatever its exit code; empty where there is none."""
    try:
        done = subprocess.run(
            command, cwd=where, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL, timeout=patience_s
        )
        found = json.loads(done.stdout)
    except (OSError, subprocess.TimeoutExpired, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def ask(tool: str, patience_s: float) -> Answer:
    """What both registries answer."""
    words = ("-r", str(LOCK), "--no-deps", "--disable-pip", "--format", "json", "--progress-spinner", "off", "--timeout", "5")
    pip = of_pip_audit(_report((tool, *words), ROOT, patience_s))
    npm = shutil.which("npm", path=os.pathsep.join((os.environ.get("PATH", ""), str(ROOT / ".venv/bin"))))
    web = Answer(silent=["there is no npm to ask"])
    if npm is not None:
        web = of_npm_audit(_report((npm, "audit", "--package-lock-only", "--json"), WEB, patience_s))
    return Answer(pip.asked + web.asked, pip.unknown, pip.found + web.found, pip.silent + web.silent)


def _locked() -> str:
    return hashlib.sha256(LOCK.read_bytes() + (WEB / "package-lock.json").read_bytes()).hexdigest()


def _answered(now_s: float) -> str | None:
    """What was said of the same lock files within a day."""
    try:
        last = json.loads(ANSWERED.read_text())
        return str(last["line"]) if last["locked"] == _locked() and 0.0 <= now_s - last["at_s"] < DAY_S else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def briefly(tool: str, now_s: float) -> str:
    """One line. now_s: seconds since 1970."""
    if shutil.which(tool) is None:
        return "audit: nobody was asked; `make audit` installs pip-audit and asks"
    line = _answered(now_s)
    if line is None:
        line = ask(tool, BRIEF_PATIENCE_S).line()
        ANSWERED.write_text(json.dumps({"line": line, "locked": _locked(), "at_s": now_s}))
    return line


def main(words: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="scripts.audit", description="Known vulnerabilities of locked packages.")
    parser.add_argument("tool", help="pip-audit")
    parser.add_argument("--briefly", action="store_true", help="one line, at most once a day; never an error")
    given = parser.parse_args(words)
    if given.briefly:
        print(briefly(given.tool, time.time()))
        return 0
    answer = ask(given.tool, PATIENCE_S)
    for line in [*answer.found, answer.line()]:
        print(line)
    return int(bool(answer.found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

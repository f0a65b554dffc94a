"""A pytest plugin: with CI=true a test may be skipped only for a reason that stands here.

What set-up can install (scripts/setup_tests.sh) is no reason. `-rs` prints all reasons, with or without CI.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable

import pytest

ALLOWED = (
    # Data and models that are not ours to give away.
    r"shared/data",
    r"VISTEL_MODEL_[A-Z]+ names none",
    # Programs that no Debian package has, or that need a registry or rights which CI's machine may not have.
    r"clients/web/node_modules",
    r"vrpn_server",
    r"(docker compose|kubectl|systemd-analyze) is not on this machine",
    r"(kubernetes_validate|mkdocs_material|rerun|cyclonedx-bom) is not installed",
    r"etcd is not on this machine",  # a package, which not everybody may install
    r"network namespaces need root",
    r"mounting a file system is not allowed here",
    r"this user may write everywhere",  # root
    # Another system, processor or driver than that of the machine; what it has instead is tested there.
    r"on Linux",
    r"POSIX paths",
    r"looks for x86 (vector )?registers",
    r"no 512-bit registers here",
    r"this driver has stereo buffers",
    r"this driver does not listen to",
    r"what was looked at was drawn by software OpenGL",
)
"""Regular expressions, searched for in the reason."""
_ALLOWED = re.compile("|".join(ALLOWED))


def not_allowed(reports: Iterable[pytest.CollectReport | pytest.TestReport]) -> list[str]:
    """Each skip whose reason is not in `ALLOWED`, as one line."""
    out: set[str] = set()
    for report in reports:
        if isinstance(report.longrepr, tuple) and not _ALLOWED.search(report.longrepr[2]):
            out.add(f"{report.nodeid}: {report.longrepr[2]}")
    return sorted(out)


def _found(config: pytest.Config) -> list[str]:
    terminal = config.pluginmanager.getplugin("terminalreporter")
    if os.environ.get("CI") != "true" or terminal is None:  # a worker of pytest-xdist has no terminal
        return []
    return not_allowed(terminal.stats.get("skipped", []))


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """A session that was well fails."""
    if exitstatus == pytest.ExitCode.OK and _found(session.config):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Which tests, and why."""
    if found := _found(config):
        terminalreporter.section("skipped, and CI=true does not allow it (tests/skips.py)", red=True)
        for line in found:
            terminalreporter.line(line)

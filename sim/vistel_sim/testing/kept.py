"""What is kept of a test that fails: logs of devices and processes, named in its report."""

import shutil
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

_KEEP = "--vistel-keep"
_Keeper = tuple[Path, Callable[[Path], list[Path]]]
_KEPT = pytest.StashKey[list[_Keeper]]()


def keep(request: pytest.FixtureRequest, folder: Path, files: Callable[[Path], list[Path]]) -> None:
    """When the test fails, call `files` with `folder`, where it may write; what it returns is named in the test's report."""
    request.node.stash.setdefault(_KEPT, []).append((folder, files))


def pytest_addoption(parser: pytest.Parser) -> None:
    """See pytest."""
    about = "folder to copy the logs of VISTEL's devices and conferences to when a test fails"
    parser.getgroup("vistel").addoption(_KEEP, metavar="FOLDER", type=Path, default=None, help=about)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """See pytest: the devices of a test run still when its call has failed."""
    report = yield
    if report.when in ("setup", "call") and report.failed and (keepers := item.stash.get(_KEPT, [])):
        into: Path | None = item.config.getoption(_KEEP)
        if into is not None:
            into /= "".join(c if c.isalnum() or c in "-_." else "_" for c in item.nodeid)
        report.sections.append(("VISTEL kept", "\n".join(_kept(keepers, into))))
    return report


def _kept(keepers: list[_Keeper], into: Path | None) -> list[str]:
    """The files that are kept: where they are, or copied into a folder."""
    try:
        files = [file for folder, written in keepers for file in written(folder)]
        if into is not None:
            into.mkdir(parents=True, exist_ok=True)
            files = [_copied(f, into) for f in files]
    except OSError as e:
        return [f"{e.filename}: cannot be kept: {e.strerror}"]
    return [str(f) for f in files] or ["nothing was logged"]


def _copied(file: Path, into: Path) -> Path:
    """The copy; of two files of one name the second is called by its folder, too."""
    to = into / file.name
    return Path(shutil.copy2(file, into / f"{file.parent.name}-{file.name}" if to.exists() else to))

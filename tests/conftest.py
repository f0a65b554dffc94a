"""Fixtures for every test."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest_plugins = ("compiled_once", "found_examples", "late_sockets", "skips", "pytester")

# One thread for a matrix, as services have it: where other tests keep the cores busy, a second one waits for its turn and the
# first for it, thirty times as long as the product takes. Read when numpy and OpenCV are first imported.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
    os.environ.setdefault(_name, "1")

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Real recordings kept beside the repository; tests that need them skip where they are absent."""
    path = ROOT.parent / "shared" / "data"
    if not path.is_dir():
        pytest.skip("real recordings (../shared/data) are not on this machine")
    return path


@pytest.fixture(scope="session", autouse=True)
def _no_words_while_commands_wait() -> Iterator[None]:
    """Whether a command says that it still waits depends on the machine: only tests of that hear it."""
    from vistel_cli import waiting

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(waiting, "SILENT_S", 3600.0)
        yield


def pytest_collection() -> None:
    """Half a million objects are made now, hardly one of them garbage."""
    gc.disable()


def pytest_collection_finish() -> None:
    """They stay: whoever looks for garbage from now on need not look through them."""
    gc.collect()
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Two more than there are cores: whole conferences, which come first, wait for most of their time."""
    return (os.cpu_count() or 1) + 2


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests come first: run side by side, none of them is left for one process at the end. Then those that compute
    and those that mostly wait for processes, browsers and clocks come by turns, so that neither cores nor clocks are idle."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    place = dict.fromkeys(slow, -1.0)
    quick = dict.fromkeys(item.path for item in items if item.path not in slow)
    for computes in (True, False):
        files = [path for path in quick if path.is_relative_to(ROOT / "tests/unit") == computes]
        place |= {path: n / len(files) for n, path in enumerate(files)}
    items.sort(key=lambda item: place[item.path])

"""A pytest plugin: Hypothesis draws the same examples everywhere, or with `--hypothesis-profile fuzz` always others.

What fails is printed as an `@example` to keep above its test.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from hypothesis import is_hypothesis_test, settings
from hypothesis.internal.conjecture import providers

# No deadline: the first call of a kernel may compile it, and no test is about time.
settings.register_profile("same", deadline=None, database=None, derandomize=True)
settings.register_profile("fuzz", deadline=None, database=None, derandomize=False, max_examples=2_000)  # where CI is set, too
settings.load_profile("same")

ROUNDS = 20
"""How often `fuzz` runs each test that says itself how many examples it draws."""
_FAILING = re.compile(r"(?:Failing test case|Falsifying example): \w+\((.*)\)\s*\Z", re.DOTALL)


def pytest_configure(config: pytest.Config) -> None:
    """Hypothesis also draws constants of the modules that are imported, which differ with what else the process has run."""
    if config.getoption("--hypothesis-profile") != "fuzz":
        providers._get_local_constants = lambda: providers._local_constants


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Those called fuzz ask VISTEL_FUZZ_EXAMPLES how many there shall be; the others run several times."""
    fuzzes = metafunc.config.getoption("--hypothesis-profile") == "fuzz"
    if fuzzes and is_hypothesis_test(metafunc.function) and "fuzz" not in metafunc.definition.nodeid:
        metafunc.fixturenames.append("fuzz_round")
        metafunc.parametrize("fuzz_round", range(ROUNDS))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(call: pytest.CallInfo[None]) -> Iterator[None]:
    """Adds the example to what is printed of a failed test."""
    report = yield
    if call.excinfo is not None:
        for note in _notes(call.excinfo.value):
            if found := _FAILING.match(note):
                report.sections.append(("to keep above the test", f"@example({found[1]})"))
    return report


def _notes(error: BaseException) -> Iterator[str]:
    yield from getattr(error, "__notes__", ())
    if isinstance(error, BaseExceptionGroup):
        for one in error.exceptions:
            yield from _notes(one)

"""The test command tells the truth: what is skipped, and which example fails."""

from __future__ import annotations

from pathlib import Path

import pytest
import skips

SKIPPING = """
import pytest

@pytest.mark.parametrize("n", range(3))
def test_passes(n):
    pass

@pytest.mark.parametrize("n", range(3))
def test_skips(n):
    pytest.skip({reason!r})
"""


@pytest.fixture(autouse=True)
def plugins(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(skips.__file__).parent))
    pytester.makeconftest("pytest_plugins = ('found_examples', 'skips')")


@pytest.mark.parametrize("workers", [(), ("-n", "2")])
@pytest.mark.parametrize(
    ("ci", "reason", "fails"),
    [
        ("true", "there is no Xvfb: apt-get install xvfb", True),
        ("true", "no 512-bit registers here", False),
        ("", "there is no Xvfb: apt-get install xvfb", False),
    ],
)
def test_in_ci_a_skip_without_an_allowed_reason_fails(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, workers: tuple[str, ...], ci: str, reason: str, fails: bool
) -> None:
    monkeypatch.setenv("CI", ci)
    pytester.makepyfile(SKIPPING.format(reason=reason))
    done = pytester.runpytest_subprocess("-rs", *workers)
    assert done.ret == (pytest.ExitCode.TESTS_FAILED if fails else pytest.ExitCode.OK)
    done.assert_outcomes(passed=3, skipped=3)
    done.stdout.fnmatch_lines(f"*SKIPPED*{reason}")
    if fails:
        done.stdout.fnmatch_lines(f"*::test_skips?2?: Skipped: {reason}")


@pytest.mark.parametrize("workers", [(), ("-n", "2")])
def test_in_ci_a_file_that_is_skipped_whole_fails_too(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, workers: tuple[str, ...]
) -> None:
    monkeypatch.setenv("CI", "true")
    pytester.makepyfile(test_one="import pytest\npytest.importorskip('no_such_module')", test_two="def test_passes(): pass")
    done = pytester.runpytest_subprocess(*workers)
    assert done.ret == pytest.ExitCode.TESTS_FAILED
    done.stdout.fnmatch_lines("*test_one.py: Skipped: could not import 'no_such_module'*")


def test_an_expected_failure_is_no_skip(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "true")
    pytester.makepyfile("import pytest\n@pytest.mark.xfail\ndef test_fails(): assert False")
    assert pytester.runpytest_subprocess().ret == pytest.ExitCode.OK


def test_what_set_up_installs_is_no_reason() -> None:
    for reason in ("no Chromium on this machine", "PulseAudio is not installed", "neither flite nor espeak-ng is installed"):
        report = pytest.TestReport("a", ("a", 0, ""), {}, "skipped", ("a.py", 1, f"Skipped: {reason}"), "call")
        assert skips.not_allowed([report]) == [f"a: Skipped: {reason}"]


DRAWING = """
from hypothesis import given, settings, strategies as st

@settings(max_examples=5)
@given(n=st.integers(), text=st.text())
def test_draws(n, text):
    print("drew", n, repr(text))
    assert {condition}
"""


def drawn(pytester: pytest.Pytester, *options: str) -> list[str]:
    return [line for line in pytester.runpytest_subprocess("-s", *options).outlines if "drew" in line]


def test_the_same_examples_are_drawn_every_time_and_others_where_that_is_asked_for(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(DRAWING.format(condition="True"))
    assert len(drawn(pytester)) == 5
    assert drawn(pytester) == drawn(pytester)
    fuzzed = drawn(pytester, "--hypothesis-profile", "fuzz")
    assert len(fuzzed) == 100
    assert fuzzed != drawn(pytester, "--hypothesis-profile", "fuzz")


def test_examples_do_not_depend_on_what_else_was_imported(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(DRAWING.replace("max_examples=5", "max_examples=300").format(condition="True"))
    before = drawn(pytester)
    pytester.makepyfile(numbers_of_mine="MINE = [" + ", ".join(str(10**6 + 7 * k) for k in range(300)) + "]")
    pytester.makeconftest("pytest_plugins = ('found_examples', 'skips')\nimport numbers_of_mine")
    assert drawn(pytester) == before


def test_what_fails_is_printed_as_an_example_to_keep(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(DRAWING.format(condition="n < 2"))
    done = pytester.runpytest_subprocess("--hypothesis-profile", "fuzz", "-x")
    done.stdout.fnmatch_lines(["*to keep above the test*", "@example(", "    n=2,", "    text='',*", ")"])

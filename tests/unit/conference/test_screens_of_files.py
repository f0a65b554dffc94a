"""Screens of a conference file that are none: one line says which, what is wrong and what to do, and nothing is opened."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from vistel.conference.files import ConferenceError, load

GOOD = {"lower_left": "[0.5, 0.8, 1.0]", "lower_right": "[-0.5, 0.8, 1.0]", "upper_left": "[0.5, 1.4, 1.0]"}


def written(folder: Path, **change: str) -> Path:
    rows = "\n".join(f"{key} = {value}" for key, value in (GOOD | change).items())
    path = folder / "wall.toml"
    site = '[[sites]]\nname = "tokyo"\n[[sites.participants]]\nname = "aiko"'
    path.write_text(f'name = "wall"\n{site}\n[[sites.display.screens]]\nname = "left"\n{rows}\n')
    return path


def test_a_screen_whose_corners_make_a_rectangle_is_taken(tmp_path: Path) -> None:
    (screen,) = load(written(tmp_path)).sites[0].display.screens
    assert screen.upper_left == (0.5, 1.4, 1.0)
    # Nobody measures to the millimetre: a degree off is taken as it is.
    assert load(written(tmp_path, upper_left="[0.51, 1.4, 1.0]")).sites[0].display.screens[0].upper_left[0] == 0.51


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"upper_left": "[0.1, 0.8, 1.0]"}, "lie in one line, they make no right angle at the lower left one (0 degrees)"),
        ({"upper_left": "[0.9, 0.8, 1.0]"}, "lie in one line, they make no right angle at the lower left one (180 degrees)"),
        ({"upper_left": "[0.2, 1.1, 1.0]"}, "corners make no right angle at the lower left one (45 degrees)"),
        ({"upper_left": "[0.5, 0.8, 1.0]"}, "are two corners the same"),
        ({"upper_left": "[nan, 1.4, 1.0]"}, "finite number"),
        ({"lower_right": "[-inf, 0.8, 1.0]"}, "finite number"),
        ({"gain": "[1.0, nan, 1.0]"}, "finite number"),
        ({"lower_left": "[0.5, 0.8]"}, "is missing"),
        ({"width": "0"}, "expected at least 16"),
        ({"height": "20000"}, "expected at most 16384"),
    ],
)
def test_one_that_is_none_is_refused_with_file_place_and_reason(tmp_path: Path, change: dict[str, str], said: str) -> None:
    path = written(tmp_path, **change)
    with pytest.raises(ConferenceError) as fault:
        load(path)
    line = str(fault.value)
    assert said in line and "\n" not in line
    assert re.match(rf"{re.escape(str(path))}:\d+: sites\[0\]\.display\.screens\[0\]", line)

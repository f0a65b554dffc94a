"""What the calibration asks of a person has a Japanese sentence on the page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from vistel.figure.calibration.moves import STEPS
from vistel.protocol.glove_fit import HANDS
from vistel_cli.studio import calibration, live_calibration
from vistel_cli.studio.wrinkles.bends import BENDS

ROOT = Path(__file__).parents[4]
TABLE = (ROOT / "clients" / "web" / "studio" / "said.ts").read_text("utf-8")
OURS = [Path(str(module.__file__)).read_text("utf-8") for module in (live_calibration, calibration)]
TOLD = [said for source in OURS for said in re.findall(r'(?<!")"([A-Z][^"{}\n]*\.)"(?!")', source)]
"""Its sentences, without docstrings."""


@pytest.mark.parametrize("said", [*(s.say for s in STEPS), *(say for _, say in HANDS)])
def test_every_move_and_hand_is_asked_for_in_japanese(said: str) -> None:
    assert f'"{said}":' in TABLE


def test_so_is_what_the_studio_itself_says() -> None:
    assert "Computing." in TOLD
    assert [said for said in TOLD if f'"{said}":' not in TABLE] == []


@pytest.mark.parametrize(
    "word", sorted({b.label for b in BENDS} | {b.group for b in BENDS} | {s.name for s in STEPS} | {n for n, _ in HANDS})
)
def test_sliders_moves_and_hands_have_japanese_names(word: str) -> None:
    word = word.replace("_", " ")
    assert f'"{word}":' in TABLE or f"  {word}: " in TABLE

"""What stands over the picture for who sets a conference up."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.figure.posture.posture import standing
from vistel.render.overlays.gauges import Rate, paint, rows_of
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import PlayoutWorld

MS = 1_000_000


def instant(*people: tuple[str, Timing]) -> Instant:
    shown = tuple(PersonNow(ParticipantInfo(name.lower(), name), standing(), timing) for name, timing in people)
    return Instant(0, shown, PlayoutWorld(), {})


def test_the_rate_is_counted_over_half_a_second() -> None:
    rate = Rate()
    for k in range(40):
        rate.drew(k * 40 * MS)
    assert rate.hertz == pytest.approx(25.0, rel=0.05)


def test_each_person_has_a_row_with_delay_age_and_jitter() -> None:
    rows = rows_of(instant(("Aiko", Timing(120 * MS, 35 * MS, 4 * MS, False))), 24.9, 0.71)
    assert rows[0] == (" 24.9 pictures/s, drawn at 71 %", False)
    text, amiss = rows[1]
    assert text.split() == ["Aiko", "delay", "120", "age", "35", "jitter", "4", "ms"]
    assert not amiss


def test_who_is_late_or_held_stands_out_and_long_names_are_cut() -> None:
    rows = rows_of(instant(("Aiko", Timing(0, 900 * MS, 0, False)), ("Maximiliane Augusta", Timing(0, 0, 0, True))), 0.0, 1.0)
    assert [amiss for _, amiss in rows] == [False, True, True]
    assert rows[2][0].startswith("Maximiliane A…")
    assert rows[2][0].endswith("held")


def test_rows_are_painted_apart_and_warnings_in_another_colour() -> None:
    picture = paint((("plain", False), ("amiss", True)), 20)
    upper, lower = picture[10:30].reshape(-1, 4), picture[30:50].reshape(-1, 4)
    assert np.abs(upper[:, 0].astype(int) - upper[:, 2]).max() < 30
    assert (lower[:, 0].astype(int) - lower[:, 2]).max() > 100

"""Numbers of a log by name: which there are, with units, and how they go over time in few points."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vistel.log
from vistel.log import fields
from vistel.log.fields import Curve, Field, curves, fields_of, unit_of
from vistel.log.numbers import UnknownNumberError, tracks
from vistel.log.two import BESIDE, DIFFERENCE, Pair
from vistel.v1.service_pb2 import Heartbeat, ImageDelay
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.topics import BY_NAME

MEETING = Path(__file__).parents[2] / "replay" / "meeting.mcap"
HAND = "participant.ben.motion.left_hand.x"


def test_the_numbers_of_a_log_are_named_with_their_units_and_each_can_be_read() -> None:
    with vistel.log.open(MEETING) as log:
        found = fields_of(log)
        assert Field(HAND, "m") in found and Field("thing.baton.speed", "m/s") in found
        assert Field("command_result.aiko.step", "") in found
        assert len({name for name, _ in found}) == len(found)
        for name, unit in (f for f in found if f.name.split(".")[0] not in ("participant", "thing")):
            assert tracks(log, [name])[name].t.size and unit_of(name) == unit


def test_lists_and_messages_in_messages_are_named_place_by_place(tmp_path: Path) -> None:
    path = tmp_path / "site.mcap"
    with LogWriter(path) as writer:
        delay = ImageDelay(site="tokyo", frames_per_s=30.0, streams=[ImageDelay.Stream(participant="ben", delay_s=0.1)])
        for message, topic, key in (
            (delay, "image_delay", "vistel/c/site/tokyo/renderer/delay"),
            (Heartbeat(node="tokyo/a", uptime_ns=5), "heartbeat", "vistel/c/site/tokyo/node/a/heartbeat"),
        ):
            message.header.version = 1
            writer.write(BY_NAME[topic], key, message, 1_000_000_000)
    with vistel.log.open(path) as log:
        found = dict(fields_of(log))
        assert found["image_delay.tokyo.streams.0.delay_s"] == "s" and found["image_delay.tokyo.frames_per_s"] == "1/s"
        assert found["heartbeat.a.uptime_ns"] == "ns"
        assert tracks(log, ["image_delay.tokyo.streams.0.delay_s"])["image_delay.tokyo.streams.0.delay_s"].value[
            0
        ] == pytest.approx(0.1)


@given(
    st.lists(st.tuples(st.floats(0, 10), st.floats(-1e6, 1e6) | st.just(float("nan"))), max_size=300),
    st.integers(1, 40),
    st.integers(1, 7),
)
def test_a_curve_keeps_what_is_least_and_greatest_in_few_points(points: list[tuple[float, float]], bins: int, parts: int) -> None:
    points = sorted(points, key=lambda p: p[0])
    curve = Curve(0.0, 10.0, bins)
    for part in range(parts):
        some = points[part * len(points) // parts : (part + 1) * len(points) // parts]
        curve.add(np.array([t for t, _ in some]), np.array([v for _, v in some]))
    found = curve.track()
    known = np.array([v for _, v in points if not np.isnan(v)])
    assert np.all(np.diff(found.t) >= 0.0)
    assert np.isfinite(found.value).sum() <= max(2 * bins, 0)
    if len(known):
        assert np.nanmin(found.value) == known.min() and np.nanmax(found.value) == known.max()
    else:
        assert not np.isfinite(found.value).any()


def test_a_log_read_part_by_part_gives_what_it_gives_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [HAND, "thing.baton.y", "participant.ben.motion.left_hand.speed"]
    with vistel.log.open(MEETING) as log:
        whole = tracks(log, names)
        monkeypatch.setattr(fields, "PART_S", 0.7)
        *_, (done, found) = curves(partial(tracks, log), names, 0.0, log.duration, 1000)
        assert done == 1.0
        for name in names:
            assert np.array_equal(found[name].t, whole[name].t)
            assert np.allclose(found[name].value, whole[name].value, equal_nan=True)


def test_where_nothing_comes_for_long_a_curve_has_a_gap() -> None:
    curve = Curve(0.0, 20.0, 100)
    t = np.array([0.0, 0.1, 0.2, 9.0, 9.1])
    curve.add(t, np.ones(5))
    assert np.isnan(curve.track().value).sum() == 1


def test_a_number_that_the_log_cannot_have_is_refused_and_one_that_comes_later_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fields, "PART_S", 1.0)
    with vistel.log.open(MEETING) as log:
        with pytest.raises(UnknownNumberError, match="nobody"):
            list(curves(partial(tracks, log), ["thing.nobody.x", HAND], 0.0, log.duration, 10))
        *_, (_, found) = curves(partial(tracks, log), ["touch.aiko.baton"], 0.0, log.duration, 10)
        assert found["touch.aiko.baton"].t.size


def test_a_log_differs_from_itself_by_nothing_and_moved_by_as_much_as_it_moves() -> None:
    with vistel.log.open(MEETING) as log:
        same = Pair(log, log).tracks([DIFFERENCE + HAND, BESIDE + HAND, HAND], 1.0, 3.0)
        assert np.nanmax(np.abs(same[DIFFERENCE + HAND].value)) == 0.0
        one, other = (t[(t > 1.1) & (t < 2.9)] for t in (same[BESIDE + HAND].t, same[HAND].t))
        assert len(one) > 100 and np.array_equal(one, other)
        later = Pair(log, log, 0.5).tracks([BESIDE + HAND, DIFFERENCE + HAND], 4.0, 5.0)
        assert later[BESIDE + HAND].t.min() >= 4.0 and later[BESIDE + HAND].t.max() < 5.0
        assert np.nanmax(np.abs(later[DIFFERENCE + HAND].value)) > 0.005
        with pytest.raises(UnknownNumberError, match="no log beside"):
            Pair(log).tracks([BESIDE + HAND], 0.0)


def test_beyond_the_end_of_the_other_log_nothing_is_known() -> None:
    with vistel.log.open(MEETING) as log:
        found = Pair(log, log, 100.0).tracks([DIFFERENCE + HAND, BESIDE + HAND], 1.0, 2.0)
        assert np.isnan(found[DIFFERENCE + HAND].value).all() and found[BESIDE + HAND].t.size == 0


def test_a_cut_off_log_has_the_numbers_of_what_is_whole(tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(MEETING.read_bytes()[:120_000])
    with vistel.log.open(cut) as log:
        assert Field(HAND, "m") in fields_of(log)
        *_, (_, found) = curves(partial(tracks, log), [HAND], 0.0, log.duration, 50)
        assert found[HAND].t.size and LogReader(cut).damage

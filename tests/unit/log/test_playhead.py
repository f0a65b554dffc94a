"""The playhead of a log: where it is after some time, and what a viewer may say to it."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.log.playhead import FASTEST, MOST_LETTERS, SLOWEST, NotUnderstoodError, Playhead, understood


def told(head: Playhead, **asked: object) -> Playhead:
    return head.told(asked)


def test_it_moves_at_its_speed_only_while_it_plays_and_stops_at_the_end() -> None:
    head = Playhead(10.0, speed=2.0)
    assert head.after(1.0) == head
    playing = told(head, playing=True)
    assert playing.after(1.5).t == 3.0
    assert (playing.after(6.0).t, playing.after(6.0).playing) == (10.0, False)


def test_play_at_the_end_begins_again() -> None:
    assert told(Playhead(10.0, t=10.0), playing=True).t == 0.0


def test_a_loop_is_played_again_and_again_with_the_time_that_was_over() -> None:
    head = told(Playhead(10.0), loop=[4.0, 2.0], t=3.5, playing=True)
    assert head.loop == (2.0, 4.0)
    assert head.after(1.0).t == pytest.approx(2.5)
    assert head.after(5.0).t == pytest.approx(2.5)
    assert told(head, loop=None).loop is None
    assert told(head, loop=[3.0, 3.0]).loop is None


def test_it_counts_how_often_it_has_gone_elsewhere() -> None:
    head = told(Playhead(10.0), loop=[2.0, 4.0], t=3.5, playing=True)
    assert (head.leaps, head.after(0.1).leaps, head.after(1.0).leaps) == (1, 1, 2)
    assert told(head, speed=2.0).leaps == 1


def test_it_says_what_it_was_asked_last() -> None:
    head = told(Playhead(10.0), speed=2.0, n=7)
    assert json.loads(head.words())["asked"] == 7
    assert told(head, t=1.0).asked == 7


def test_times_and_speeds_out_of_range_are_taken_to_the_nearest_in_range() -> None:
    assert told(Playhead(10.0), t=-3).t == 0.0
    assert told(Playhead(10.0), t=1e9).t == 10.0
    assert told(Playhead(10.0), speed=1e9).speed == FASTEST
    assert told(Playhead(10.0), speed=0).speed == SLOWEST


@pytest.mark.parametrize(
    "said",
    [
        "",
        "[]",
        "{",
        '{"t": "1"}',
        '{"t": true}',
        '{"t": NaN}',
        '{"speed": Infinity}',
        '{"loop": [1]}',
        '{"loop": 3}',
        "[" * 300,
        "x" * (MOST_LETTERS + 1),
    ],
)
def test_what_cannot_be_done_is_refused(said: str) -> None:
    with pytest.raises(NotUnderstoodError):
        Playhead(10.0).told(understood(said))


@given(
    st.text(max_size=60)
    | st.dictionaries(st.sampled_from(["t", "speed", "loop", "playing"]), st.floats() | st.none()).map(json.dumps)
)
def test_whatever_is_said_the_playhead_stays_within_the_log(said: str) -> None:
    try:
        head = Playhead(10.0).told(understood(said)).after(3.0)
    except NotUnderstoodError:
        return
    assert 0.0 <= head.t <= 10.0 and SLOWEST <= head.speed <= FASTEST

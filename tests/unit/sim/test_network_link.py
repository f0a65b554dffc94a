"""A simulated link does to packets what its conditions say; a TCP stream loses nothing and pays with time."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel_sim.network.link import MATHIS, SEGMENT_BYTES, Conditions, Link

CONDITIONS = st.builds(
    Conditions,
    delay_s=st.floats(0.0, 0.3),
    jitter_s=st.floats(0.0, 0.1),
    loss=st.floats(0.0, 0.5),
    reorder=st.floats(0.0, 1.0),
    bits_per_s=st.sampled_from([64e3, 1e6, math.inf]),
)
RATE_S = 1.0 / 60.0


def arrivals(conditions: Conditions, n: int, *, stream: bool = False, size: int = 200) -> list[float | None]:
    """When each of n packets arrives that are sent one every 60th of a second."""
    link = Link(conditions, random.Random(1))
    send = link.segment if stream else link.datagram
    return [send(size, i * RATE_S) for i in range(n)]


@given(CONDITIONS)
def test_hypothesis_no_packet_arrives_before_the_shortest_delay(conditions: Conditions) -> None:
    for stream in (False, True):
        for i, t in enumerate(arrivals(conditions, 50, stream=stream)):
            assert t is None or t >= i * RATE_S + conditions.delay_s


@given(CONDITIONS)
def test_hypothesis_a_stream_loses_nothing_and_keeps_its_order(conditions: Conditions) -> None:
    times = arrivals(conditions, 50, stream=True)
    assert None not in times
    assert times == sorted(times, key=lambda t: t or 0.0)


def test_datagrams_are_lost_as_often_as_was_asked_for() -> None:
    lost = [t is None for t in arrivals(Conditions(loss=0.05), 20_000)]
    assert np.mean(lost) == pytest.approx(0.05, abs=0.005)


def test_without_reordering_jitter_keeps_the_order_and_with_it_some_overtake() -> None:
    ordered = arrivals(Conditions(0.05, 0.05), 1000)
    assert ordered == sorted(t for t in ordered if t is not None)
    mixed = arrivals(Conditions(0.05, 0.05, reorder=0.1), 1000)
    assert mixed != sorted(t for t in mixed if t is not None)


def test_a_lost_segment_holds_back_all_that_follows_it() -> None:
    conditions = Conditions(0.05, 0.0, loss=0.05)
    late_stream = [t - i * RATE_S for i, t in enumerate(arrivals(conditions, 2000, stream=True)) if t]
    late = [t - i * RATE_S for i, t in enumerate(arrivals(conditions, 2000)) if t]
    assert max(late) == pytest.approx(0.05)
    assert np.percentile(late_stream, 90) > 0.1


def test_a_thin_line_sends_as_fast_as_it_can_and_drops_what_its_queue_does_not_hold() -> None:
    link = Link(Conditions(bits_per_s=64e3, queue_bytes=8000), random.Random(1))
    times = [link.datagram(1000, 0.0) for _ in range(20)]
    passed = [t for t in times if t is not None]
    assert passed == pytest.approx([0.125 * (i + 1) for i in range(len(passed))])
    assert len(passed) == 9
    assert link.waiting_bytes(0.0) == pytest.approx(9000)


def test_losses_bound_the_speed_of_a_stream() -> None:
    link = Link(Conditions(0.05, 0.0, loss=0.01), random.Random(1))
    assert link.stream_bits_per_s() == pytest.approx(MATHIS * SEGMENT_BYTES * 8 / (0.1 * 0.1))


def test_after_a_cut_a_stream_goes_on_when_tcp_tries_again() -> None:
    link = Link(Conditions(0.05), random.Random(1))
    link.cut(100.0)
    assert link.datagram(10, 101.0) is None
    assert link.heal(110.0) == pytest.approx(100.0 + 0.2 + 0.4 + 0.8 + 1.6 + 3.2 + 6.4)
    assert link.datagram(10, 111.0) == pytest.approx(111.05)
    assert link.heal(120.0) == 120.0


def test_what_opens_a_connection_and_is_lost_is_sent_again_after_one_and_two_seconds() -> None:
    link = Link(Conditions(0.05, loss=0.5), random.Random(1))
    waits_s = {round(link.first(10.0) - 10.05) for _ in range(200)}
    assert {0, 1, 3, 7} <= waits_s <= {2**n - 1 for n in range(20)}


@pytest.mark.parametrize("wrong", [{"loss": 1.0}, {"loss": math.nan}, {"delay_s": -0.1}, {"bits_per_s": 0.0}, {"reorder": 1.5}])
def test_conditions_that_no_link_has_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="expected"):
        Conditions(**wrong)

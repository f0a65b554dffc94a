"""What counts as too late to be shown."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from vistel.wire.freshness import Freshness

MS = 1_000_000
LIMIT = 250 * MS


def steady(freshness: Freshness, start_ns: int, count: int, skew_ns: int, period_ns: int = 16 * MS) -> list[bool]:
    return [freshness.accept(start_ns + i * period_ns - skew_ns, start_ns + i * period_ns) for i in range(count)]


@given(skew_ns=st.integers(-(10**15), 10**15))
def test_a_steady_stream_is_fresh_whatever_the_senders_clock_says(skew_ns: int) -> None:
    assert all(steady(Freshness(LIMIT), 10**18, 200, skew_ns))


@given(skew_ns=st.integers(-(10**12), 10**12), late_ms=st.integers(300, 10_000))
def test_what_a_healed_link_delivers_from_before_the_cut_is_stale(skew_ns: int, late_ms: int) -> None:
    freshness = Freshness(LIMIT)
    steady(freshness, 10**18, 60, skew_ns)
    healed = 10**18 + 60 * 16 * MS + late_ms * MS
    backlog = [freshness.accept(10**18 + (60 + i) * 16 * MS - skew_ns, healed + i * MS // 10) for i in range(10)]
    assert not any(backlog[: max(1, min(10, (late_ms - 250) // 16))])
    assert all(steady(freshness, healed + 2 * MS, 100, skew_ns)), "the live stream goes on at once"


def test_a_clock_that_steps_back_holds_the_stream_up_for_a_second_only() -> None:
    freshness = Freshness(LIMIT)
    steady(freshness, 10**18, 60, 0)
    after = steady(freshness, 10**18 + 2000 * MS, 200, skew_ns=5000 * MS)
    assert not any(after[:60])
    assert all(after[64:])


def test_a_clock_that_steps_forward_costs_nothing() -> None:
    freshness = Freshness(LIMIT)
    steady(freshness, 10**18, 60, 0)
    assert all(steady(freshness, 10**18 + 2000 * MS, 100, skew_ns=-5000 * MS))


def test_a_clock_that_is_slewed_stays_fresh() -> None:
    freshness = Freshness(LIMIT)
    for i in range(6000):
        t = 10**18 + i * 16 * MS
        assert freshness.accept(t - int(i * 16 * MS * 0.01), t)

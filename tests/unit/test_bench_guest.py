"""What `vistel bench guest` computes of what it has seen, and how its guests without a browser keep time."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks.pages import bench_console, bench_guest, guest_cost, guest_ink, guest_lag, guest_page
from benchmarks.pages.light_guests import CYCLE, RATES, at_rate, raising_arms, seen_by_camera
from benchmarks.parts import rows_of
from benchmarks.row import Row
from vistel.protocol.pages.camera_body import MOST_BYTES, camera_record
from vistel.space.boards.stroke import FURTHEST, MOST_POINTS
from vistel.wire.clock import SimulatedClock
from vistel_cli.main import app

SECOND_NS = 1_000_000_000


@pytest.mark.parametrize("stalled_s", [0.0, 0.05, 1.0])
def test_what_a_stalled_guest_sends_too_late_is_left_out_and_never_many_at_once(stalled_s: float) -> None:
    sent: list[tuple[int, int]] = []

    async def play() -> None:
        clock = SimulatedClock(5 * SECOND_NS)

        async def act(n: int) -> None:
            sent.append((n, clock.now_ns() - 5 * SECOND_NS))
            if n == 10 and stalled_s:
                await clock.sleep_until_ns(clock.now_ns() + round(stalled_s * 1e9))

        sending = asyncio.create_task(at_rate(clock, 30.0, 3.0, act))
        for tick in range(1, 400):
            await clock.advance_to_ns(5 * SECOND_NS + tick * 10_000_000)
        await sending

    asyncio.run(play())
    numbers, times = [n for n, _ in sent], np.array([t_ns for _, t_ns in sent])
    assert numbers[:11] == list(range(11)) and numbers[-1] == 89
    assert len(sent) == 90 - max(0, int(stalled_s * 30.0) - 1)
    assert np.all(times - np.array(numbers) * SECOND_NS / 30.0 >= 0)
    per_second = [np.sum((times >= t) & (times < t + SECOND_NS)) for t in times]
    assert max(per_second) <= 31, "what was late did not come all at once"


def test_the_up_link_counts_records_at_their_rates_whatever_was_left_out() -> None:
    rows = list(guest_cost.up_link({"mouse": 26.0, "camera": 276.0, "voice": 72.0}))
    assert rows[0].value == pytest.approx(8e-3 * (30 * 276 + 50 * 72)) and rows[0].met is True
    assert [row.value for row in rows] == sorted(row.value for row in rows) and rows[1].target is None
    assert next(iter(guest_cost.up_link({"camera": 400.0, "voice": 72.0}))).met is False


def test_what_guests_without_a_browser_show_is_all_that_a_page_can_show() -> None:
    records = [camera_record(0, seen) for seen in seen_by_camera(raising_arms())]
    assert len(records) == CYCLE and np.median([*map(len, records)]) == MOST_BYTES


def test_strokes_of_two_hands_are_what_a_page_may_write_and_a_lost_point_is_found() -> None:
    sent = guest_ink.strokes_of(1) | guest_ink.strokes_of(2)
    assert len(sent) == guest_ink.STROKES
    for points in sent.values():
        assert len(points) == len(set(points)) <= MOST_POINTS
        assert np.abs(np.diff(points, axis=0)).max() <= FURTHEST and np.min(points) >= 0
    written = {name: set(points) for name, points in sent.items()}
    count = sum(map(len, sent.values()))
    assert guest_ink.lost(sent, written) == (count, 0)
    written["1 3"].remove(sent["1 3"][7])
    del written["2 5"]
    assert guest_ink.lost(sent, written) == (count, 1 + len(sent["2 5"]))


@pytest.mark.parametrize("late_ms", [0, 35, 120, 410])
def test_how_late_a_hand_follows_is_found(late_ms: int) -> None:
    step_ns = round(1e9 / RATES["camera"])
    rng = np.random.default_rng(1)

    def high(t_ns: float) -> float:
        return 1.0 + 0.2 * np.cos(2 * np.pi * t_ns / (CYCLE * step_ns))

    true = [(n * step_ns, high(n * step_ns)) for n in range(10 * CYCLE)]
    times = range(0, 10 * CYCLE * step_ns, step_ns // 2)
    followed = [(t, 0.3 + 0.8 * high(t - late_ms * 1e6) + 0.002 * rng.normal()) for t in times]
    lags = guest_lag.lags_ms(true, followed)
    assert len(lags) >= 8 and np.median(lags) == pytest.approx(late_ms, abs=6)


def test_a_figure_that_follows_a_film_is_as_late_as_it_is_and_moves_it_misses_do_not_count() -> None:
    def film(t_ms: float) -> float:
        return 0.2 if t_ms % 20_000 < 10_000 else 0.6

    def posed(t_ms: float) -> float:
        return 0.8 if 40_000 <= t_ms < 60_000 else 0.7 + film(t_ms - 1_500)  # it sees nothing for one turn

    seen = [(t * 1_000_000, film(t)) for t in range(0, 100_000, 400)]
    figure = [(t * 1_000_000, posed(t)) for t in range(0, 100_000, 20)]
    late = guest_page.follows_ms(seen, figure)
    assert 4 <= len(late) < 9 and np.median(late) == pytest.approx(1_500, abs=20)
    assert guest_page.follows_ms([], figure) == []


def _row(name: str) -> Row:
    return Row("guest", name, "metric", "ms", 1.0)


def test_parts_run_alone_and_one_that_fails_keeps_no_other_from_running(capsys: pytest.CaptureFixture[str]) -> None:
    def one() -> Iterator[Row]:
        yield _row("one")
        raise RuntimeError("no room")

    parts = {"one": one, "two": lambda: iter([_row("two")])}
    assert [row.case for row in rows_of(parts, ["two"])] == ["two"]
    came: list[str] = []
    with pytest.raises(RuntimeError, match=r"^not measured: one$"):
        came.extend(row.case for row in rows_of(parts))
    assert came == ["one", "two"] and "one: failed, no room" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["guest", "--part", "mouse"], "bench guest: no such part: mouse; there are page, lag, ten, slides, ink"),
        (["wire", "--part", "mouse"], "bench wire: has no parts; leave out --part"),
        (["--all", "--part", "page"], "bench: --part is for one benchmark; leave out --all"),
    ],
)
def test_a_part_that_is_not_there_is_wrong_usage(words: list[str], said: str) -> None:
    result = CliRunner().invoke(app, ["bench", *words])
    assert result.exit_code == 2 and " ".join(result.stderr.split()) == f"error: {said}"


def test_only_the_parts_that_are_asked_for_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_guest, "PARTS", {name: lambda name=name: iter([_row(name)]) for name in bench_guest.PARTS})
    result = CliRunner().invoke(app, ["bench", "guest", "--json", "--part", "ink", "--part", "lag"])
    assert result.exit_code == 0
    assert [line.split('"case": "')[1].split('"')[0] for line in result.stdout.splitlines()] == ["lag", "ink"]
    assert set(bench_console.PARTS) == {"live", "logs"}

"""Whether every point comes to the board of what two guests write at once, each with one hand, for a minute."""

import asyncio
import contextlib
from collections.abc import Iterator, Mapping, Set

import numpy as np

from benchmarks.pages.guest_seats import seated, until
from benchmarks.pages.live_conference import LiveConference, beside, live_conference
from benchmarks.progress import part
from benchmarks.row import NONE_AT_ALL, Row, at_least
from vistel.space.boards.stroke import unpacked
from vistel.wire import background, event_loop
from vistel.wire.clock import sleep
from vistel.wire.world.listener import WorldListener

STROKES, HANDS, MINUTE_S = 200, 2, 60.0
MESSAGES, POINTS = 3, 10
"""Of a stroke: so many messages, each of so many points."""
_LAST_S = 60.0
"""In which guests enter, and the last stroke comes, besides [s]."""
_BOARD = "board"
_THINGS = f'[[room.things]]\nid = "{_BOARD}"\nname = "board"\nshape = "board"\nat = [1.5, 1.5]\n'

Point = tuple[int, int]


def rows() -> Iterator[Row]:
    """Figures of ink."""
    sent, written, took_s = event_loop.run(background.as_service("ink", _measure()))
    points, gone = lost(sent, written)
    case = f"{len(sent)} strokes of {HANDS} guests"
    yield Row("guest", case, "strokes", "1/min", 60.0 * len(sent) / took_s, target=at_least(0.99 * STROKES))
    yield Row("guest", case, "points sent", "points", points)
    yield Row("guest", case, "points lost", "points", gone, target=NONE_AT_ALL)


def lost(sent: Mapping[str, list[Point]], written: Mapping[str, Set[Point]]) -> tuple[int, int]:
    """How many points were sent, and how many of them are not on the board. sent, written: points of each stroke, by its id."""
    return sum(map(len, sent.values())), sum(p not in written.get(name, ()) for name, points in sent.items() for p in points)


def strokes_of(number: int) -> dict[str, list[Point]]:
    """What a guest writes in a minute, by the ids of strokes: no step is longer than one of ink."""
    rng = np.random.default_rng(number)
    out: dict[str, list[Point]] = {}
    for n in range(STROKES // HANDS):
        begin, steps = rng.integers((300, 300), (3000, 2000)), rng.integers((4, -8), (12, 9), (MESSAGES * POINTS, 2))
        out[f"{number} {n}"] = [(int(x), int(y)) for x, y in begin + np.cumsum(steps, axis=0)]
    return out


async def _measure() -> tuple[dict[str, list[Point]], dict[str, set[Point]], float]:
    """What was sent, what is on the board, and how long it took to send [s]."""
    sent: dict[str, list[Point]] = {}
    written: dict[str, set[Point]] = {}
    async with live_conference("ink", guests=HANDS, things=_THINGS) as live:
        with contextlib.closing(WorldListener(live.bus, live.clock)) as listener, part("a minute of strokes"):

            def whole() -> bool:
                taken = listener.take()
                if not taken or not writing.done():
                    return False  # to read all strokes at every step would take this process from its guests
                strokes = taken[-1][0].strokes.values()
                written.update((stroke.id, {(int(x), int(y)) for x, y in unpacked(stroke.ink)}) for stroke in strokes)
                return lost(sent, written)[1] == 0

            async with beside(_write_all(live, sent)) as writing:
                with contextlib.suppress(RuntimeError):
                    await until(whole, _LAST_S + 2.0 * MINUTE_S, "the last stroke")
                took_s = await writing
    return sent, written, took_s


async def _write_all(live: LiveConference, sent: dict[str, list[Point]]) -> float:
    """All guests' strokes. Seconds until the last of them is done."""
    return max(await asyncio.gather(*(_write(live, n, sent) for n in range(1, HANDS + 1))))


async def _write(live: LiveConference, number: int, sent: dict[str, list[Point]]) -> float:
    """One guest's strokes, evenly; what is late is written at once, because nobody leaves out what they have drawn. Seconds."""
    async with seated(live, number) as guest:
        begun_ns, turn_ns = live.clock.now_ns(), round(1e9 * MINUTE_S * HANDS / STROKES / MESSAGES)
        turn = 0
        for name, points in strokes_of(number).items():
            sent[name] = points
            for n in range(0, len(points), POINTS):
                await live.clock.sleep_until_ns(begun_ns + turn * turn_ns)
                flat = [k for point in points[n : n + POINTS] for k in point]
                await guest.socket.send_json({"draw": flat, "board": _BOARD, "stroke": name, "colour": "#222222"})
                turn += 1
        await live.clock.sleep_until_ns(begun_ns + turn * turn_ns)
        took_s = (live.clock.now_ns() - begun_ns) * 1e-9
        await sleep(live.clock, 1.0)  # what was sent last arrives before the page goes
        return took_s

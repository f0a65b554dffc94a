"""A graphics card that goes away, what was set at a window when it does, and turns in drawing."""

from __future__ import annotations

import asyncio
import itertools
import logging
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from vistel.conference.running import running_folder
from vistel.render.figures.figures import DrawableFigure, StandIn
from vistel.render.stage.stage import Instant, ParticipantInfo
from vistel.render.turns import DrawingTurn
from vistel.render.view.view import View
from vistel.wire.clock import SystemClock
from vistel_services.renderer import drawing_thread
from vistel_services.renderer.drawing_thread import DrawingThread

pytestmark = pytest.mark.gl


def shapes(about: ParticipantInfo) -> DrawableFigure:
    return StandIn(about.height)


@pytest.mark.parametrize("how", ["released", "told by the driver"])
def test_a_context_that_is_lost_in_the_middle_is_made_again_and_pictures_go_on(
    how: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    thread = ThreadPoolExecutor(1)
    now_ns = itertools.count(1, drawing_thread.RETRY_NS // 4)
    one = DrawingThread("tokyo", View(160, 90, "room", ""), 30.0, 3, None, True, shapes, thread, {})

    async def picture() -> float:
        for _ in range(10):
            whole = one._renderer is not None and one._renderer.complete
            drawn = await one.draw(lambda: Instant(next(now_ns)))
            if drawn is not None and whole:
                return float(drawn[..., :3].std())
            if one._renderer is not None:
                one._renderer._smoothing.result()  # pictures come without their last filter until it is there
        raise AssertionError("no picture comes any more")

    async def scenario() -> tuple[float, float]:
        before = await picture()
        assert one._renderer is not None
        if how == "released":
            await one._call(one._renderer._surface.ctx.release)
        else:
            monkeypatch.setattr(one._renderer.painter, "error", lambda: "GL_UNKNOWN_ERROR")  # as moderngl names a lost context
        with caplog.at_level(logging.ERROR):
            after = await picture()
        await one.close()
        return before, after

    before, after = asyncio.run(scenario())
    thread.shutdown()
    assert before > 20.0
    assert after == pytest.approx(before, rel=0.01)
    assert sum("set_up_again" in r.message for r in caplog.records) == 1


def test_the_wait_for_a_turn_counts_as_time_that_a_picture_takes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Else machines on which several renderers take turns would keep every pixel, and their rate would fall."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(drawing_thread, "places_here", lambda: 1)
    thread, clock = ThreadPoolExecutor(1), SystemClock()
    one = DrawingThread("tokyo", View(160, 90, "room", ""), 30.0, 3, None, False, shapes, thread, {})
    took = list[int]()

    def drew(now_ns: int, took_ns: int) -> float:
        took.append(took_ns)
        return 1.0

    async def scenario() -> None:
        other = DrawingTurn(running_folder(), 1)
        await one.draw(lambda: Instant(1))
        assert one._renderer is not None
        if not one._renderer.capability.software:
            pytest.skip("a graphics card draws here: nobody takes turns")
        one._renderer._smoothing.result()
        assert one._resolution is not None
        monkeypatch.setattr(one._resolution, "drew", drew)
        await other.begin(clock)
        waits = asyncio.create_task(one.take_turn(clock))
        await asyncio.sleep(0)  # it begins to wait
        await asyncio.sleep(0.05)  # what is waited is real time
        other.end()
        await waits
        await one.draw(lambda: Instant(2))
        await one.close()
        other.close()

    asyncio.run(scenario())
    thread.shutdown()
    assert len(took) == 1
    assert took[0] >= 45_000_000

"""A graphics card that goes away, and what was set at a window when it does."""

from __future__ import annotations

import asyncio
import logging
from concurrent.futures import ThreadPoolExecutor

import pytest

from vistel_services.renderer import easel
from vistel_services.renderer.easel import Easel
from vistel_services.renderer.figures import Shape, StandIn
from vistel_services.renderer.stage import About, Instant
from vistel_services.renderer.view import View

pytestmark = pytest.mark.gl


def shapes(about: About) -> Shape:
    return StandIn(about.height)


@pytest.mark.parametrize("how", ["released", "told by the driver"])
def test_a_context_that_is_lost_in_the_middle_is_made_again_and_pictures_go_on(
    how: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(easel, "RETRY_S", 0.05)
    thread = ThreadPoolExecutor(1)
    one = Easel("tokyo", View(160, 90, "room", "", False), 30.0, 3, None, True, shapes, thread, {})

    async def picture() -> float:
        for _ in range(6):
            whole = one._studio is not None and one._studio.complete
            drawn = await one.draw(Instant(1))
            if drawn is not None and whole:
                return float(drawn[..., :3].std())
            if one._studio is not None:
                one._studio._smoothing.result()  # pictures come without their last filter until it is there
        raise AssertionError("no picture comes any more")

    async def scenario() -> tuple[float, float]:
        before = await picture()
        assert one._studio is not None
        if how == "released":
            await one._call(one._studio._surface.ctx.release)
        else:
            monkeypatch.setattr(one._studio.painter, "error", lambda: "GL_UNKNOWN_ERROR")  # as moderngl names a lost context
        with caplog.at_level(logging.ERROR):
            after = await picture()
        await one.close()
        return before, after

    before, after = asyncio.run(scenario())
    thread.shutdown()
    assert before > 20.0
    assert after == pytest.approx(before, rel=0.01)
    assert sum("set_up_again" in r.message for r in caplog.records) == 1

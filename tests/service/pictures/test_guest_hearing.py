"""What a guest's page plays, in a real browser: a voice sounds when its picture is seen, also while the page's thread is held up.

All services share one event loop here, and the processor draws: what is measured is whether voice and picture are late together,
not how late. A machine that cannot draw and play at once fails, so `make test` leaves it out and `make hearing` runs it.
"""

from __future__ import annotations

import asyncio
import json
import time
from pathlib import Path

import numpy as np
import pytest
from browser import page
from guest_room import GuestRoom, at_the_door
from page_speech import LISTEN, envelope, speak, talk

from vistel.arrays import F64
from vistel_services.console import bundle

FLAGS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
FLAGS += ("--autoplay-policy=no-user-gesture-required",)
SKEW_MS = 45.0
"""A voice after its lips or before them, on a machine that may be busy."""
SECONDS, HELD_S = 14.0, 6.0
HOLD = "(() => { const begun = performance.now(); while (performance.now() < begun + 700); return true; })()"


def heard_later(heard: F64, said: F64, begin_ms: float, end_ms: float) -> tuple[float, float]:
    """How much later than it was said a part is heard [ms], and how alike the two are (correlation). heard, said: (n, 2), times
    [ms] and levels."""
    part = said[(said[:, 0] >= begin_ms) & (said[:, 0] < end_ms)]
    speaks = (part[:, 1] > 0.01).astype(float)

    def alike(later_ms: float) -> float:
        levels = np.minimum(np.interp(part[:, 0] + later_ms, heard[:, 0], heard[:, 1]), 0.02)
        return float(np.corrcoef(levels, speaks)[0, 1]) if levels.any() else 0.0

    return max((alike(later_ms), later_ms) for later_ms in np.arange(0.0, 2500.0, 4.0))[::-1]


@pytest.mark.measures
def test_a_voice_is_heard_when_its_picture_is_seen_also_while_the_page_is_held_up(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")

    async def visit() -> None:
        async with (
            page(tmp_path, *FLAGS, seldom=False) as tab,
            GuestRoom(tmp_path).serving(monkeypatch) as room,
            room.opened(room.invited("guest-2", "Bob")) as other,
        ):
            await other.enter("ben")
            async with other.listening():
                await at_the_door(tab, room, room.invited(), 480, 420)
                await tab.click(".people button[aria-current=true]")
                await tab.until("window.guest.me() === 'guest-1' && window.guest.ready() >= 2 && window.guest.voices.pictureMs")
                assert await tab.value(LISTEN)
                sound = talk(2, SECONDS)
                talking = asyncio.create_task(speak(room, other, sound))
                await asyncio.sleep(HELD_S)  # what is held up is the page, in the middle of what is said
                await tab.value(HOLD)
                begun_ns = await talking
                await tab.until("window.guest.voices.played.get('guest-2')?.skewMs === null")  # all is heard
                heard, picture_ms, offset_ms = json.loads(
                    await tab.value("JSON.stringify([window.heard(), window.guest.voices.pictureMs, performance.timeOrigin])")
                )
            delay_ms = next(p["delay_ms"] for p in other.newest["numbers"]["people"] if p["name"] == "guest-2")
            # Both clocks are this machine's: what the page calls a time, in conference time.
            off_ms = room.clock.now_ns() * 1e-6 - time.time_ns() * 1e-6 + offset_ms
            levels = np.array(heard) + np.array((off_ms, 0.0))
            loud = envelope(sound, 96)
            said = np.stack((begun_ns * 1e-6 + np.arange(len(loud)) * 2 + 1, loud), 1)
            late_ms, alike = heard_later(levels, said, said[0, 0] + 3000, said[-1, 0])
            assert alike > 0.8, (late_ms, alike)
            assert abs(late_ms - delay_ms - (picture_ms + off_ms)) < SKEW_MS, (late_ms, delay_ms, picture_ms + off_ms)

    asyncio.run(visit())

"""A guest puts up a board, writes on it with the mouse in a real browser, rubs out and takes back, and everybody has it."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import numpy as np
import pytest
from browser import Page, page
from guest_room import GuestRoom, at_the_door
from waiting import until

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.render.stage.world_view import thing_of
from vistel.space.boards.board import face_of
from vistel.space.boards.stroke import unpacked
from vistel.wire.world.decoder import RoomState
from vistel.wire.world.listener import WorldListener
from vistel_services import world
from vistel_services.console import bundle

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
FREE = "([x, y]) => document.elementFromPoint(x, y)?.id === 'room'"
"""Whether there is the picture at a place of the page, and no button."""


async def mouse(tab: Page, kind: str, at: list[float], buttons: int = 1) -> None:
    await tab.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button="left", buttons=buttons, clickCount=1)


async def places(tab: Page, now: RoomState, board: str, points: list[tuple[float, float]]) -> list[list[float]]:
    """Where places of a board's grid are on the page [px]."""
    face, (position, rotation) = face_of(thing_of(now.things[board])), now.poses[board]
    assert face is not None
    there = (
        face.place(np.array(points), np.zeros(len(points))) @ matrix_from_quaternion(np.ascontiguousarray(rotation)).T + position
    )
    return await tab.value(f"{json.dumps(there.tolist())}.map((at) => window.guest.seen(at))")


async def looked_at(tab: Page, now: RoomState, board: str, line: list[tuple[float, float]]) -> list[list[float]]:
    """Turn until a line on the board lies in the picture; where it is."""
    for _ in range(60):
        at = await places(tab, now, board, line)
        if await tab.value(f"{json.dumps(at)}.every({FREE})"):
            return at
        middle = await tab.value(f"window.guest.seen({json.dumps(now.poses[board][0].tolist())})[0] < innerWidth / 2")
        await tab.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowLeft" if middle else "ArrowRight")
        await asyncio.sleep(0.1)  # the page turns when it draws
    raise AssertionError("the board does not come into the picture")


async def drag(tab: Page, way: list[list[float]]) -> None:
    await mouse(tab, "mousePressed", way[0])
    for at in way[1:]:
        await mouse(tab, "mouseMoved", at)
    await mouse(tab, "mouseReleased", way[-1], 0)


@pytest.mark.slow
def test_what_a_guest_writes_with_the_mouse_is_on_the_board_of_everybody(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")

    async def visit() -> None:
        async with page(tmp_path, *SOFTWARE_GL) as tab, GuestRoom(tmp_path).serving(monkeypatch) as room:
            bus = room.network.bus("c", "hub", room.clock)
            leading = asyncio.create_task(world.run(world.configure(room.conference, None, room.paths), bus, room.clock))
            listener, newest = WorldListener(room.network.bus("c", "guests", room.clock), room.clock), [RoomState()]

            def now() -> RoomState:
                newest.extend(state for state, _ in listener.take())
                del newest[:-1]
                return newest[0]

            def boards() -> list[str]:
                return [t.id for t in now().things.values() if t.shape == "board"]

            await at_the_door(tab, room, room.invited(), 960, 620)
            await tab.click(".people button[aria-current=true]")
            await tab.until("window.guest.me() === 'guest-1'")
            await tab.click("#new-board")
            await until(boards, "a board", tasks=[leading])
            (board,) = boards()
            await tab.until("document.querySelector('.pens')")
            await tab.until(f"window.guest.thing({board!r}) !== null")
            await tab.click(".pen[title='Write in red']")

            line = [(600.0 + 40.0 * k, 1500.0 + 250.0 * np.sin(k / 6.0)) for k in range(50)]
            at = await looked_at(tab, now(), board, line)
            await drag(tab, at)
            await until(lambda: now().strokes, "a stroke", tasks=[leading])
            await until(lambda: unpacked(next(iter(now().strokes.values())).ink)[-1, 0] > 2500, "all of it", tasks=[leading])
            (stroke,) = now().strokes.values()
            assert (stroke.by, stroke.board, stroke.colour) == ("guest-1", board, 0xC23B32FF)
            drawn = unpacked(stroke.ink)
            size = float(np.ptp([x for x, _ in at])) / 2000.0  # pixels of a unit
            for x, y in line:
                assert np.abs(drawn - (x, y)).max(axis=1).min() < 3.0 / size + 60.0, "the mouse was there"

            await tab.click("#rub")
            across = await places(tab, now(), board, [(1500.0, 1000.0), (1500.0, 1500.0), (1500.0, 1950.0)])
            await drag(tab, across)
            await until(lambda: not now().strokes, "nothing is left", tasks=[leading])
            await tab.click("#undo-stroke")
            await until(lambda: now().strokes, "the stroke is back", tasks=[leading])
            await tab.click("#wipe")
            await until(lambda: not now().strokes, "a clean board", tasks=[leading])
            assert tab.messages == []
            leading.cancel()
            await asyncio.gather(leading, return_exceptions=True)

    asyncio.run(visit())

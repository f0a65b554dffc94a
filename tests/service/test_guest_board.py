"""What a guest's page asks for comes through gateway, site and world, and back to every page as strokes on a board."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from guest_room import GuestRoom
from waiting import until

from vistel_services.world.service import warm_up


def test_a_guest_puts_up_a_board_writes_and_takes_it_back(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    warm_up()  # else the loop stands still while this process compiles, and who asks the world waits for no answer so long

    async def visit() -> None:
        async with GuestRoom(tmp_path).serving(monkeypatch) as room, room.opened(room.invited()) as page, room.led() as leading:
            await page.enter("carla")
            async with page.listening() as listens:

                def faces() -> list[str]:
                    return [t["id"] for t in page.newest.get("table", {}).get("things", []) if t["face"]]

                def ink() -> dict[str, object]:
                    words = page.newest.get("ink", {"strokes": [], "gone": []})
                    return {"strokes": [(s["by"], s["board"], s["colour"]) for s in words["strokes"]], "gone": words["gone"]}

                await until(lambda: page.in_the_world("guest-1"), "the guest sits in the world's room", tasks=[leading, listens])
                await page.socket.send_json({"new_board": True})
                await until(faces, "a board", tasks=[leading, listens])
                (board,) = faces()
                await page.socket.send_json({"draw": [100, 100, 200, 200], "board": board, "stroke": "s", "colour": "#c23b32"})
                await until(lambda: ink()["strokes"] == [("guest-1", board, "#c23b32")], "the stroke", tasks=[leading, listens])
                await page.socket.send_json({"undo": True})
                await until(lambda: ink()["gone"], "it is gone", tasks=[leading, listens])

    asyncio.run(visit())

"""What a guest's page asks for comes through gateway, site and world, and back to every page as strokes on a board."""

from __future__ import annotations

import asyncio
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import page
from guest_room import GuestRoom, at_the_door
from waiting import until

from vistel.space.boards.stroke import unpacked
from vistel_services.console import bundle, guests
from vistel_services.world.service import warm_up

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")


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


def test_what_a_guest_asks_for_on_a_connection_that_has_broken_is_done_once_it_is_back(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")
    warm_up()
    lost: list[dict[str, Any]] = []
    deaf = [False]
    told = guests._Visit._take_words

    def lose(self: Any, said: dict[str, Any], now_ns: int) -> None:
        if deaf[0] and "n" in said:
            lost.append(said)
        else:
            told(self, said, now_ns)

    monkeypatch.setattr(guests._Visit, "_take_words", lose)

    async def visit() -> None:
        async with page(tmp_path, *SOFTWARE_GL) as tab, GuestRoom(tmp_path).serving(monkeypatch) as room, room.led() as leading:
            bob = room.invited("guest-2", "Bob")
            async with room.opened(bob) as other:
                await other.enter("ben")
                async with other.listening() as listens:
                    await at_the_door(tab, room, room.invited(), 480, 320)
                    await tab.click(".people button[aria-current=true]")
                    both = ("guest-1", "guest-2")
                    sit = "they sit in the world's room"
                    await until(lambda: all(map(other.in_the_world, both)), sit, tasks=[leading, listens])
                    await other.socket.send_json({"new_board": True})
                    await tab.until("Boolean(document.querySelector('button.pen'))")
                    board = next(t["id"] for t in other.newest["table"]["things"] if t["face"])
            await tab.click("button.pen")
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="l")  # stand before it
            middle = (
                "(box => [box.x + box.width / 2, box.y + box.height / 2])(document.getElementById('room').getBoundingClientRect())"
            )
            x, y = await tab.value(middle)
            await tab.until(f"Math.abs(window.guest.seen(window.guest.thing('{board}'))[0] - {x}) < 1")

            async def mouse(kind: str, n: int) -> None:
                at = {"x": x + 3 * n, "y": y + n}
                await tab.call("Input.dispatchMouseEvent", type=kind, button="left", buttons=1, clickCount=1, **at)

            deaf[0] = True
            await mouse("mousePressed", 0)
            for n in range(1, 5):
                await mouse("mouseMoved", n)
            await until(lambda: lost, "a part of a stroke is sent, and lost", tasks=[leading])
            await tab.value("document.querySelector('#chat-button').click()")  # the mouse is pressed elsewhere
            await tab.until("Boolean(document.querySelector('#chat input'))")
            await tab.value("document.querySelector('#chat input').focus()")
            await tab.call("Input.insertText", text="is it on the board?")
            await tab.until("document.querySelector('#chat input').value")
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="Enter", text="\r")
            await until(lambda: "write" in lost[-1], "a line is sent, and lost", tasks=[leading])
            await tab.value("document.querySelector('#raise').click()")
            await until(lambda: "hand_down" in lost[-1], "a hand is raised, and nobody hears", tasks=[leading])
            deaf[0] = False
            room.cut()
            async with room.opened(bob) as other:
                await other.enter("ben")
                async with other.listening() as listens:

                    def said() -> list[tuple[str, str]]:
                        return [(n["who"], n["text"]) for n in other.newest.get("chat", {"lines": []})["lines"]]

                    def drawn() -> list[list[int]]:
                        ink = [b64decode(s["ink"]) for s in other.newest.get("ink", {"strokes": []})["strokes"]]
                        return unpacked(ink[0]).tolist() if ink else []

                    await until(said, "the line", tasks=[leading, listens])
                    assert said() == [("guest-1", "is it on the board?")]
                    await mouse("mouseReleased", 4)
                    points = [p for part in lost for p in np.reshape(part.get("draw", []), (-1, 2)).tolist()]
                    await until(lambda: drawn()[: len(points)] == points, "the stroke", tasks=[leading, listens])
                    await until(lambda: other.newest["signals"]["raised"], "the hand", tasks=[leading, listens])

    asyncio.run(visit())

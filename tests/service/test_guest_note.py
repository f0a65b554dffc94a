"""A sticky note that a guest writes on their page: the key opens a line for the text, and the note lies there to be read."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest
from browser import page
from guest_room import GuestRoom, at_the_door
from waiting import until

from vistel.space.notes.note import SIDE
from vistel_services.console import bundle
from vistel_services.world.service import warm_up

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
TEXT = "buy milk"
ON_THE_TABLE_M = 0.7225


def test_a_guest_writes_a_note_and_reads_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")
    warm_up()  # else the loop stands still while this process compiles, and who asks the world waits for no answer so long

    async def visit() -> None:
        async with (
            page(tmp_path, *SOFTWARE_GL) as tab,
            GuestRoom(tmp_path).serving(monkeypatch) as room,
            room.opened(room.invited("guest-2", "Bob")) as other,
            room.led() as leading,
        ):
            await other.enter("ben")
            async with other.listening() as listens:
                parts = [leading, listens]
                await at_the_door(tab, room, room.invited(), 960, 900)
                await tab.click(".people button[aria-current=true]")
                await tab.until("window.guest.me() === 'guest-1'")
                await until(lambda: other.in_the_world("guest-1"), "the guest sits in the room", tasks=parts)
                await tab.call("Input.dispatchKeyEvent", type="keyDown", key="m")
                await tab.until("document.activeElement?.name === 'note'")
                await tab.call("Input.insertText", text=TEXT)
                await tab.call("Input.dispatchKeyEvent", type="keyDown", key="Enter", text="\r")
                await tab.until("!document.getElementById('note')")

                def notes() -> dict[str, str]:
                    return {t["id"]: t["name"] for t in other.newest["table"]["things"] if t["id"].startswith("note-guest-1-")}

                await until(lambda: list(notes().values()) == [TEXT], "the other guest has it", tasks=parts)
                (note,) = notes()
                lies = f"(p => p && Math.abs(p[1] - {ON_THE_TABLE_M}) < 2e-3 && p)(window.guest.thing({note!r}))"
                place = np.array(await tab.until(lies))
                await tab.value("window.guest.sharp()")
                # Within the paper, whichever way it is turned.
                corners = [place + 0.25 * SIDE * np.array((a, 0.0, b)) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]

                async def seen() -> np.ndarray:
                    at = np.array([await tab.value(f"window.guest.seen({c.tolist()})") for c in corners])
                    (left, top), (right, bottom) = at.min(axis=0).astype(int), at.max(axis=0).astype(int)
                    return (await tab.picture()).astype(int)[top:bottom, left:right, :3]

                def written(now: np.ndarray) -> bool:
                    paper = (now[..., 0] > 120) & (now[..., 0] - now[..., 2] > 60)
                    if paper.mean() < 0.5:
                        return False
                    ink = now.max(axis=2) < 0.6 * now[paper].max(axis=1).mean()
                    return 0.02 < ink.mean() < 0.4  # dark letters

                while not written(await seen()):  # the file of its looks is on the way, and the view follows the guest's eyes
                    await asyncio.sleep(0.1)
                assert not [m for m in tab.messages if "Error" in m], tab.messages

    asyncio.run(visit())

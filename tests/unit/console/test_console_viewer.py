"""A viewer of the console gets the newest of each kind, words first, and never more than one of each waits."""

import asyncio

from vistel_services.console.viewer import FRAME, Viewer


def test_who_is_slow_gets_words_first_and_then_the_newest_frame() -> None:
    async def watch() -> list[str | bytes]:
        viewer = Viewer()
        for k in range(100):
            viewer.put(FRAME, bytes([k]))
        viewer.put("table", "old")
        viewer.put("held", "baton")
        viewer.put("table", "new")
        assert viewer.left_out == 99
        return [await viewer.next() for _ in range(3)]

    assert asyncio.run(watch()) == ["new", "baton", bytes([99])]


def test_who_is_quick_gets_every_frame() -> None:
    async def watch() -> None:
        viewer = Viewer()
        waiting = asyncio.create_task(viewer.next())
        await asyncio.sleep(0)
        viewer.put(FRAME, b"1")
        assert await waiting == b"1"
        assert viewer.left_out == 0

    asyncio.run(watch())


def test_a_slow_viewer_gets_words_first_and_frames_and_dents_by_turns() -> None:
    async def take() -> None:
        viewer = Viewer()
        got: list[str | bytes] = []
        for n in range(4):
            for kind in (FRAME, "dents0", "skin", "table"):
                viewer.put(kind, f"{kind} {n}")
            got += [await viewer.next(), await viewer.next()]
        assert got == ["table 0", "frame 0", "table 1", "dents0 1", "table 2", "skin 2", "table 3", "frame 3"]

    asyncio.run(take())

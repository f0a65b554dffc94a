"""What the host clicks on the console's page, in a browser, is done: a guest is seated, muted and removed, and the room moved; why
something is refused stands in the language of the page."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from browser import Page, page
from guest_room import GuestRoom
from served_log import SOFTWARE_GL
from waiting import until

from vistel.conference.invitations import invitations_in
from vistel.conference.model import Conference
from vistel.session.steering import moving
from vistel.session.steering import page as told
from vistel.wire.topics import BY_NAME
from vistel_services import world
from vistel_services.console import bundle
from vistel_services.world.service import warm_up


def answered(text: str) -> str:
    return f"[...document.querySelectorAll('.answers li')].some((li) => li.innerText.includes({text!r}))"


async def ready(tab: Page) -> None:
    await tab.until("document.querySelector('.steer-people') && document.querySelector('.steer-worlds')")
    await tab.value("document.querySelectorAll('.steer-people, .steer-worlds').forEach((group) => (group.open = true))")


async def with_people(tab: Page, room: GuestRoom) -> None:
    await tab.open(f"http://{room.address}/", 1280, 800)
    await tab.until("document.querySelector('.steer-people')")
    await tab.value("document.querySelector('.steer-people').open = true")


async def press(tab: Page, selector: str) -> None:
    """Click what may still be moved by what comes above it, once it is there."""
    await tab.until(f"((button) => button && !button.disabled && (button.click(), true))(document.querySelector({selector!r}))")


async def seat(tab: Page, name: str) -> None:
    await tab.value("document.querySelector('[name=guest]').focus()")
    await tab.call("Input.insertText", text=name)
    await tab.until(f"document.querySelector('[name=guest]').value === {name!r}")  # a form without a name is not sent
    await press(tab, ".seat button")


async def steer(tab: Page, room: GuestRoom) -> None:
    mutings = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["muting"], queue_all=True, polled=True)
    acts = room.network.bus("c", "hub", room.clock).subscribe(BY_NAME["host_action"], queue_all=True, polled=True)
    muted: list[str] = []
    who: list[str] = []

    def acted() -> bool:
        who.extend(sample.message.who for sample in acts.take())
        return bool(who)

    def look() -> bool:
        muted.extend(sample.message.participant for sample in mutings.take())
        return bool(muted)

    def guests() -> list[str]:
        return [invitation.name for invitation in invitations_in(room.paths.run)]

    await tab.open(f"http://{room.address}/", 1280, 800)
    await ready(tab)
    await tab.until("!!document.querySelector('[name=author]')")
    await tab.value("document.querySelector('[name=author]').focus()")
    await tab.call("Input.insertText", text="Hana")  # who acts, though they write no note
    await tab.until("document.querySelector('[name=author]').value === 'Hana'")
    await seat(tab, "Ann")
    await until(acted, "who gave the seat")
    assert set(who) == {"Hana"}
    await tab.until("document.querySelector('.link input')?.value.includes('/join#')")
    assert guests() == ["Ann"]
    await tab.until("document.querySelector('[aria-label=\"Mute Ann\"]')")
    await press(tab, '[aria-label="Mute Ann"]')
    await until(look, "the muting of the guest")
    assert muted == ["guest-1"]
    await press(tab, '[aria-label="Remove Ann"]')
    await tab.until("document.querySelector('dialog[open]')")
    await tab.click("dialog .choices button:first-child")
    await tab.until("!document.querySelector('dialog')")
    assert guests() == ["Ann"]
    await remove(tab, "Ann")
    await until(lambda: not guests(), "the end of the invitation")
    await tab.until("!document.querySelector('.link')")

    await press(tab, '[aria-label="Move the room to guests"]')
    await tab.until(answered("Move the room to guests done"))
    await tab.until("document.querySelector('[aria-label=\"Move the room to hub\"]')")

    await press(tab, "#language")
    await tab.until("document.documentElement.lang === 'ja' && document.querySelector('.steer-people')")
    await ready(tab)
    for name in ("Ann", "Bea"):
        await seat(tab, name)
        await until(lambda name=name: name in guests(), name)
    await seat(tab, "Cho")
    await tab.until(answered("空いているゲスト席がありません"))
    assert guests() == ["Ann", "Bea"]


async def remove(tab: Page, name: str) -> None:
    await press(tab, f'[aria-label="Remove {name}"]')
    await tab.until("document.querySelector('dialog[open]')")
    await tab.click("dialog .grave")


def test_a_seat_that_is_given_and_taken_between_two_looks_of_the_server_is_free(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    monkeypatch.setattr(told, "TELL_S", 1e6)

    async def visit() -> None:
        room = GuestRoom(tmp_path)
        async with room.serving(monkeypatch), page(tmp_path, *SOFTWARE_GL) as tab:
            await with_people(tab, room)
            await seat(tab, "Ann")
            await remove(tab, "Ann")
            await until(lambda: not invitations_in(room.paths.run), "the end of the invitation")
            await tab.until("!document.querySelector('.link') && !document.querySelector('[aria-label=\"Remove Ann\"]')")

    asyncio.run(visit())


def test_what_the_host_did_when_the_connection_broke_does_not_wait_for_its_answer_for_ever(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")
    asked: list[str] = []

    async def unanswered(_: object, action: str, *__: object) -> None:
        asked.append(action)
        await asyncio.Event().wait()

    monkeypatch.setattr(told.Steering, "do", unanswered)

    async def visit() -> None:
        room = GuestRoom(tmp_path)
        async with room.serving(monkeypatch), page(tmp_path, *SOFTWARE_GL) as tab:
            await with_people(tab, room)
            await seat(tab, "Ann")
            await until(lambda: asked == ["seat"], "the seat is asked for")
            await tab.until(answered("…"))
            room.cut()
            await tab.until(answered("whether this was done is not known"))

    asyncio.run(visit())


def test_a_guest_is_seated_muted_and_removed_and_the_room_moved_by_clicks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")

    monkeypatch.setattr(moving, "MOVE_S", 3600.0)  # a busy machine moves the room later than hosts would wait

    async def visit() -> None:
        room = GuestRoom(tmp_path)
        data = room.conference.model_dump(mode="json", exclude_none=True)
        room.conference = Conference.model_validate(
            data | {"world": {"on": "hub", "waiting": ["guests"], "folder": str(tmp_path / "r")}}
        )
        waits = world.configure(room.conference, room.conference.sites[0], room.paths)
        async with room.serving(monkeypatch), room.led(), page(tmp_path, *SOFTWARE_GL) as tab:
            waiting = asyncio.create_task(world.run(waits, room.network.bus("c", "hub", room.clock), room.clock))
            try:
                await steer(tab, room)
            finally:
                waiting.cancel()
                await asyncio.gather(waiting, return_exceptions=True)
            assert not [m for m in tab.messages if "Error" in m and "WebSocket" not in m], tab.messages

    warm_up()
    asyncio.run(visit())

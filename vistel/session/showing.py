"""Showing pages in the room: they are sent to all who take part, and a panel is put up."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass

from PIL import Image

from vistel.session.asking import Answer, Asker
from vistel.space.actions import Present
from vistel.space.pages.sheet import packed_page, picture_in, sheet_of
from vistel.wire.assets import is_served
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.parcels import digest_of, send_parcel
from vistel.wire.topics import BY_NAME

TRIES = 3
"""How often a page is sent until the world has it."""


@dataclass(frozen=True)
class Page:
    """A page that can be shown. data: as it travels; model: digest of its polymesh; aspect: width by height."""

    data: bytes
    model: str
    aspect: float


def page_of_upload(data: bytes) -> Page:
    """A picture that a guest's page has sent, PNG or JPEG, as a page; its size is known before it is decoded. Raises PageError."""
    with picture_in(data, "PNG", "JPEG") as image:
        return page_of(image)


def page_of(image: Image.Image) -> Page:
    """A picture as a page; this takes some tenths of a second."""
    data, picture = packed_page(image)
    return Page(data, sheet_of(picture).digest, picture.shape[1] / picture.shape[0])


async def show(
    bus: Bus, clock: Clock, asker: Asker, pages: Sequence[Page], title: str, sent: Callable[[int], object] = lambda _: None
) -> Answer:
    """Send pages, and put up a panel with them when the first one is there. sent: told how many the world has.

    The answer is the world's: whether there is a panel, and its id.
    """
    answer = Answer(False, (), "nothing was shown")
    topic = BY_NAME["picture_part"]
    for number, page in enumerate(pages):
        digest = digest_of(page.data)

        async def send(data: bytes = page.data, picture: str = digest) -> None:
            await send_parcel(data, lambda name: bus.publish(topic, picture=picture, part=name), clock, f"{bus.site}/show")

        if not await sent_until_served(bus, clock, page, send):
            return Answer(False, answer.things, "the world did not take the picture; its log says why")
        sent(number + 1)
        if number == 0:
            answer = await asker.ask(Present(tuple(p.model for p in pages), page.aspect, title))
            if not answer.done:
                return answer
    return answer


async def sent_until_served(bus: Bus, clock: Clock, page: Page, send: Callable[[], Awaitable[None]]) -> bool:
    """Whether the world has a page, which `send` sends until it has."""
    for _ in range(TRIES):
        await send()
        if await is_served(bus, clock, page.model):
            return True
    return False

"""Guests of a live conference: links to their seats, and who takes one without a browser."""

import asyncio
import contextlib
import time
from collections.abc import AsyncGenerator, Callable

from benchmarks.pages.light_guests import LightGuest, entered
from benchmarks.pages.live_conference import LiveConference, guest
from vistel.conference.invitations import Invitation, digest_of_token, invite
from vistel.wire.world.listener import WorldListener

LOOK_S = 0.01
_ENTERS_S = 60.0
"""Within which somebody is in the world's room on any machine [s]."""
_HOUR_NS = 3_600_000_000_000


def link_to(live: LiveConference, number: int) -> str:
    """The token of a new link to a guest's seat; the one before counts no more."""
    token = f"a-token-of-a-benchmark-{number}-{time.time_ns()}"
    until_ns = live.clock.now_ns() + _HOUR_NS
    invite(live.folder, Invitation(guest(number), f"Guest {number}", "builtin:person=carla", digest_of_token(token), until_ns))
    return token


@contextlib.asynccontextmanager
async def seated(live: LiveConference, number: int, token: str = "") -> AsyncGenerator[LightGuest]:
    """A guest whom the world has in its room, while their page is open. token: of a link that was made before."""
    async with entered(live.url, token or link_to(live, number)) as light:
        with contextlib.closing(WorldListener(live.bus, live.clock)) as listener:

            def there() -> bool:
                return any(guest(number) in now.participants for now, _ in listener.take())

            await until(there, _ENTERS_S, f"{guest(number)} in the world's room")
        yield light


async def until(holds: Callable[[], object], most_s: float, what: str) -> None:
    """Raises RuntimeError where it takes longer."""
    until_s = time.monotonic() + most_s
    while not holds():
        if time.monotonic() > until_s:
            raise RuntimeError(f"{what}: not within {most_s:.0f} s")
        await asyncio.sleep(LOOK_S)

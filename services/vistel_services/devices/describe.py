"""What a device that answers says of itself when asked: firmware, and how often it measures. Nothing is changed in it."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from vistel.protocol import cyberglove, fastrak, liberty
from vistel.protocol.cyberglove import CyberGloveParser
from vistel.protocol.fastrak import FastrakParser
from vistel.protocol.fivedt import INFO, Glove16Parser, UltraParser
from vistel.wire.clock import within
from vistel_services.devices.device import Link

_ANSWER_S = 0.3
_COUNT_S = 1.0


@dataclass(frozen=True)
class About:
    """firmware: version and what else it says of itself; rate: measurements a second, in words; empty where it tells nothing."""

    firmware: str = ""
    rate: str = ""


async def describe(link: Link, name: str) -> About:
    """Ask a device of this name (see `vistel.protocol.identify`) on an open port, at the speed at which it answers."""
    return await _ASK[name](link) if name in _ASK else About()


async def _said(link: Link, question: bytes) -> bytes:
    link.recent.clear()
    if question:
        link.send(question)
    await link.quiet(_ANSWER_S, 2 * _ANSWER_S)
    return bytes(link.recent)


async def _fastrak(link: Link) -> About:
    parser = FastrakParser()
    for question in (fastrak.STATUS, fastrak.QUERY_STATIONS):
        parser.feed(await _said(link, question), 0)
    replies = parser.take_replies()
    status = next((s for s in map(fastrak.parse_status, replies) if s is not None), None)
    on = next((s for s in map(fastrak.parse_stations, replies) if s is not None), ())
    firmware = f"{status.firmware}, {status.identification}" if status is not None else ""
    return About(firmware, f"{120 / sum(on):.0f} Hz, {sum(on)} receivers" if any(on) else "")


async def _liberty(link: Link) -> About:
    said = await _said(link, liberty.WHO)
    text = re.search(rb"(?:LY|PA).\x16.{4}([\x20-\x7e\r\n]+)|00v.([\x20-\x7e\r\n]+)", said, re.DOTALL)
    model = "patriot" if b"PATRIOT" in said else "liberty"
    firmware = " ".join((text[1] or text[2]).decode("ascii").split()) if text is not None else ""
    return About(firmware, f"{liberty.RATE_HZ[model]:.0f} Hz each")


async def _cyberglove(link: Link) -> About:
    parser = CyberGloveParser()
    await _said(link, cyberglove.STOP)  # asking whether it is a FASTRAK made it stream
    for question in (cyberglove.QUERY_INFO, cyberglove.QUERY_SENSORS, cyberglove.QUERY_PERIOD):
        parser.feed(await _said(link, question), 0)
    answers = {a.name: a.data for a in parser.take_answers()}
    info = answers.get("?i", b"").decode("ascii", "replace").split("\r")[0].strip()
    sensors = f", {answers['?S'][0]} sensors" if answers.get("?S") else ""
    hz = cyberglove.rate_of(answers.get("?T", b""))
    return About(info, f"{hz:.0f} Hz{sensors}" if hz else sensors.removeprefix(", "))


async def _counted(link: Link, parser: Glove16Parser | UltraParser) -> About:
    """Of a glove that only talks."""
    count = 0
    link.recent.clear()
    with contextlib.suppress(TimeoutError):
        async with within(link.clock, _COUNT_S):
            while await link.news(_COUNT_S):
                count += len(parser.feed(bytes(link.recent), 0))
                link.recent.clear()
    return About("", f"{count / _COUNT_S:.0f} Hz")


async def _glove5(link: Link) -> About:
    found = re.search(rb"BR(.)(.)", await _said(link, INFO), re.DOTALL)
    return About(f"{found[1][0]}.{found[2][0]}" if found is not None else "")


_ASK: dict[str, Callable[[Link], Awaitable[About]]] = {
    "a Polhemus FASTRAK": _fastrak,
    "a Polhemus LIBERTY": _liberty,
    "a Polhemus PATRIOT": _liberty,
    "a CyberGlove": _cyberglove,
    "a 5DT Data Glove Ultra": lambda link: _counted(link, UltraParser()),
    "a 5DT Data Glove 16": lambda link: _counted(link, Glove16Parser()),
    "a 5DT Data Glove 5": _glove5,
}

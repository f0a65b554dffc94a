"""Asks a device for its firmware and how often it measures, and changes nothing in it (`DeviceKind.describe`)."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass

from vistel.devices.kind import DeviceKind, load
from vistel.protocol import cyberglove, fastrak, liberty
from vistel.protocol.cyberglove import CyberGloveParser
from vistel.protocol.fastrak import FastrakParser
from vistel.protocol.fivedt import INFO, Glove16Parser, UltraParser
from vistel.wire.clock import within
from vistel_services.devices.device import Link

_ANSWER_S = 0.3
"""An answer is complete when nothing has come for this time [s]."""
_COUNT_S = 1.0
"""How long the samples of a glove that only sends are counted [s]."""


@dataclass(frozen=True)
class About:
    """firmware: version and identification. rate: measurements a second, in words. Empty where the device gives none."""

    firmware: str = ""
    rate: str = ""


async def describe(link: Link, kind: DeviceKind) -> About:
    """Of a device of this kind on an open port, at the speed at which it answers."""
    return await load(kind.describe)(link) if kind.describe else About()


async def about_fastrak(link: Link) -> About:
    """A FASTRAK."""
    parser = FastrakParser()
    for question in (fastrak.STATUS, fastrak.QUERY_STATIONS):
        parser.feed(await _answer(link, question), 0)
    replies = parser.take_replies()
    status = next((s for s in map(fastrak.parse_status, replies) if s is not None), None)
    on = next((s for s in map(fastrak.parse_stations, replies) if s is not None), ())
    firmware = f"{status.firmware}, {status.identification}" if status is not None else ""
    return About(firmware, f"{120 / sum(on):.0f} Hz, {sum(on)} receivers" if any(on) else "")


async def about_liberty(link: Link) -> About:
    """A LIBERTY or PATRIOT."""
    answer = await _answer(link, liberty.WHO)
    text = re.search(rb"(?:LY|PA).\x16.{4}([\x20-\x7e\r\n]+)|00v.([\x20-\x7e\r\n]+)", answer, re.DOTALL)
    model = "patriot" if b"PATRIOT" in answer else "liberty"
    firmware = " ".join((text[1] or text[2]).decode("ascii").split()) if text is not None else ""
    return About(firmware, f"{liberty.RATE_HZ[model]:.0f} Hz each")


async def about_cyberglove(link: Link) -> About:
    """A CyberGlove."""
    parser = CyberGloveParser()
    await _answer(link, cyberglove.STOP)  # the question for a FASTRAK made it stream
    for question in (cyberglove.QUERY_INFO, cyberglove.QUERY_SENSORS, cyberglove.QUERY_PERIOD):
        parser.feed(await _answer(link, question), 0)
    answers = {a.name: a.data for a in parser.take_answers()}
    info = answers.get("?i", b"").decode("ascii", "replace").split("\r")[0].strip()
    sensors = f", {answers['?S'][0]} sensors" if answers.get("?S") else ""
    hz = cyberglove.rate_of(answers.get("?T", b""))
    return About(info, f"{hz:.0f} Hz{sensors}" if hz else sensors.removeprefix(", "))


async def about_fivedt_ultra(link: Link) -> About:
    """A 5DT Data Glove Ultra, which only sends."""
    return await _counted(link, UltraParser())


async def about_fivedt_16(link: Link) -> About:
    """A 5DT Data Glove 16, which only sends."""
    return await _counted(link, Glove16Parser())


async def about_fivedt_5(link: Link) -> About:
    """A 5DT Data Glove 5."""
    found = re.search(rb"BR(.)(.)", await _answer(link, INFO), re.DOTALL)
    return About(f"{found[1][0]}.{found[2][0]}" if found is not None else "")


async def _answer(link: Link, question: bytes) -> bytes:
    link.recent.clear()
    if question:
        link.send(question)
    await link.quiet(_ANSWER_S, 2 * _ANSWER_S)
    return bytes(link.recent)


async def _counted(link: Link, parser: Glove16Parser | UltraParser) -> About:
    count = 0
    link.recent.clear()
    with contextlib.suppress(TimeoutError):
        async with within(link.clock, _COUNT_S):
            while await link.news(_COUNT_S):
                count += len(parser.feed(bytes(link.recent), 0))
                link.recent.clear()
    return About("", f"{count / _COUNT_S:.0f} Hz")

"""Asks what hangs on a port: what answers is named, whatever was expected there."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import TypeVar

from vistel.protocol import cyberglove, fastrak, liberty
from vistel.protocol.identify import identify, identify_sender
from vistel_services.devices.device import Decoder, DeviceError, Link, NoAnswerError

T = TypeVar("T")

QUESTIONS = (b"\r" + fastrak.STATUS, b"\r" + liberty.WHO, cyberglove.QUERY_STATE, b"\x47")
"""One that each known device answers and that changes none of them: FASTRAK, LIBERTY, CyberGlove, 5DT Data Glove 5."""
_ANSWER_S = 0.25


async def who_answers(link: Link) -> str | None:
    """The name of the device on an open port, as `identify` has it; None when nothing known speaks.

    What already streams is named without a question.
    """
    await link.quiet(0.05, _ANSWER_S)
    for question in QUESTIONS:
        if (name := identify(bytes(link.recent))) is not None:
            return name
        link.send(question)
        await link.quiet(_ANSWER_S, 2 * _ANSWER_S)
    return identify(bytes(link.recent))


def refuse_others(name: str | None, own: str, short: str) -> None:
    """Raises DeviceError when what answers is known and not `own`; `short`: what was expected, for a person."""
    if name not in (None, own):
        raise DeviceError(f"{name} answers on this port; {short} was expected")


async def at_any_speed(link: Link, bauds: Sequence[int], greet: Callable[[Link], Awaitable[T | None]]) -> tuple[int, T] | None:
    """The first of the line's speeds at which something answers a greeting, and its answer."""
    for baud in bauds:
        link.set_baud(baud)
        if (answer := await greet(link)) is not None:
            return baud, answer
    return None


async def hear(link: Link, decoder: Decoder, own: str, within_s: float) -> bool:
    """Whether a sender of packets, of which nothing can be asked, is heard. Raises DeviceError where another one is, by name,
    and NoAnswerError where what comes is nobody known; `own`: who is expected."""
    seen, skipped = link.frames, decoder.bytes_skipped
    link.recent.clear()
    if await link.wait_for(lambda: link.frames if link.frames > seen else None, within_s) is not None:
        return True
    if decoder.bytes_skipped == skipped:
        return False
    name = identify_sender(bytes(link.recent))
    if name not in (None, own):
        raise DeviceError(f"{name} sends to this port; {own} was expected")
    raise NoAnswerError(f"what arrives is not from {own}; is another program sending to this port?")

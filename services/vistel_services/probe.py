"""Asks what hangs on a port: what answers is named, whatever was expected there."""

from __future__ import annotations

from vistel.protocol import cyberglove, fastrak, liberty
from vistel.protocol.identify import identify
from vistel_services.device import Link

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

"""Asks which device is connected to a port, whatever was expected there."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import TypeVar

from vistel.devices.identify import identify, questions
from vistel.devices.kind import DeviceKind
from vistel_services.devices.device import DeviceError, Link

T = TypeVar("T")

_ANSWER_S = 0.25
"""A device answers within this time [s]."""


async def who_answers(link: Link) -> DeviceKind | None:
    """The kind of the device on an open port; None when nothing known answers. A device that streams already is not asked."""
    await link.quiet(0.05, _ANSWER_S)
    for question in questions():
        if (kind := identify(bytes(link.recent))) is not None:
            return kind
        link.send(question)
        await link.quiet(_ANSWER_S, 2 * _ANSWER_S)
    return identify(bytes(link.recent))


def refuse_others(kind: DeviceKind | None, own: DeviceKind) -> None:
    """Raises DeviceError when a device of another known kind answers."""
    if kind not in (None, own):
        raise DeviceError(f"{kind.title} answers on this port; {own.title} was expected")


async def at_any_speed(link: Link, bauds: Sequence[int], greet: Callable[[Link], Awaitable[T | None]]) -> tuple[int, T] | None:
    """The first of the line's speeds at which something answers a greeting, and its answer."""
    for baud in bauds:
        link.set_baud(baud)
        if (answer := await greet(link)) is not None:
            return baud, answer
    return None

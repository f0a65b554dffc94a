"""Who a program takes part as: what it says, else what the conference file does."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from vistel.conference.model import Conference
from vistel.session.session import AsyncSession
from vistel.v1.motion_pb2 import Participant
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME

LAB = {"name": "lab", "program": True, "display_name": "The robot", "height": 1.5, "avatar": "builtin:person=ben"}


def announced(given: dict[str, Any], **of_file: Any) -> Participant:
    """How others see who publishes with `given`."""
    conference = Conference.model_validate({"sites": [{"name": "here", "participants": [LAB | of_file]}]})

    async def taking_part() -> Participant:
        network, clock = MemoryNetwork(), SystemClock()
        seen = network.bus("c", "there", clock).subscribe(BY_NAME["participant"], queue_all=True, polled=True)
        session = AsyncSession(network.bus("c", "here", clock), clock, "lab", conference)
        session.publish(**given)
        (sample,) = seen.take()
        session.close()
        return sample.message

    return asyncio.run(taking_part())


def test_what_a_program_does_not_say_of_itself_is_as_in_the_conference_file() -> None:
    about = announced({})
    assert (about.display_name, about.avatar, about.height_m) == ("The robot", "builtin:person=ben", pytest.approx(1.5))


def test_what_a_program_says_of_itself_counts() -> None:
    about = announced({"display_name": "Rob", "avatar": "builtin:person=aiko", "height_m": 1.8})
    assert (about.display_name, about.avatar, about.height_m) == ("Rob", "builtin:person=aiko", pytest.approx(1.8))


def test_a_figure_from_a_file_which_a_program_cannot_send_is_drawn_as_a_built_in_person() -> None:
    about = announced({}, avatar="me.usda", display_name="")
    assert (about.display_name, about.avatar) == ("lab", "builtin")

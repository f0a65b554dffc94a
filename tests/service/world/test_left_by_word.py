"""Who says that they left has left the room at once, and is back when they say who they are."""

from __future__ import annotations

import numpy as np

from vistel.v1.motion_pb2 import Participant
from vistel.wire.bus import Sample
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel_services.world.received import InputCollector

NAMES = {"participant": "ann", "site": "guests"}


def test_a_guest_who_left_by_word_is_out_of_the_room_and_comes_back() -> None:
    collector, encoder = InputCollector(), MotionEncoder()
    collector.presence("guests", "process-capture", True, 0)

    def says(*, left: bool, at_ns: int) -> None:
        collector.participant(Sample(BY_NAME["participant"], "", NAMES, Participant(height_m=1.7, left=left), at_ns))

    def moves(n: int) -> None:
        sample = MotionSample(n, n, np.zeros(25), np.zeros((2, 20)), np.zeros(4))
        collector.motion(Sample(BY_NAME["motion"], "key", NAMES, encoder.encode(sample), n))

    says(left=False, at_ns=1)
    moves(2)
    assert [p.participant for p in collector.take(3).people] == ["ann"]
    says(left=True, at_ns=4)
    moves(5)  # it was on its way
    now = collector.take(6)
    assert now.left == ["ann"] and not now.people and not now.motions
    says(left=False, at_ns=7)
    says(left=True, at_ns=8)
    says(left=False, at_ns=9)
    now = collector.take(10)
    assert [p.participant for p in now.people][-1] == "ann" and not now.left

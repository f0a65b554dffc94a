"""What a guest's page says, and anything else that might arrive in its place."""

from __future__ import annotations

import math
import struct

import pytest
from fuzzing import Case, fuzz, pieces, variants
from hypothesis import given

from vistel.protocol.pages.pointer import (
    FARTHEST_M,
    HIGHEST_M,
    MOST_NAME_BYTES,
    MOST_PITCH,
    MOST_YAW,
    POSTURE_BYTES,
    Pointed,
    PointerDecoder,
    guest_record,
    left_record,
    posture_of,
    posture_record,
)
from vistel.v1.device_pb2 import PointerFrame

BOTH = posture_record(0.5, -0.3, Pointed((0.2, 0.8, 0.4), 0.7, True), Pointed((-0.1, 1.0, 0.5)), PointerFrame.GESTURE_CLAP, 260)
WHO = guest_record("アン", "builtin:person=carla")


def test_a_record_says_what_was_done() -> None:
    (frame,) = PointerDecoder("ann-pointer").feed(BOTH, 7)
    assert (frame.device, frame.header.t_ns, frame.gesture, frame.gesture_number) == ("ann-pointer", 7, 6, 4)
    assert (frame.head_yaw, frame.head_pitch) == pytest.approx((0.5, -0.3), abs=1e-4)
    assert (frame.left.palm.x, frame.left.palm.y, frame.left.palm.z) == pytest.approx((0.2, 0.8, 0.4), abs=1e-3)
    assert frame.left.turn == pytest.approx(0.7, abs=1e-4) and frame.left.close
    assert not frame.right.HasField("turn") and not frame.right.close
    assert len(BOTH) == POSTURE_BYTES


def test_the_gateway_says_who_it_is_and_that_they_left() -> None:
    decoder = PointerDecoder("d")
    assert decoder.feed(WHO, 1)[0].guest.display_name == "アン" and decoder.feed(left_record(), 2)[0].guest.left
    long = decoder.feed(guest_record("é" * 500, "b" * 500), 3)[0].guest
    assert long.display_name == "é" * (MOST_NAME_BYTES // 2) and decoder.bytes_skipped == 0


@pytest.mark.parametrize(
    "record",
    [
        posture_record(yaw=2.2),
        posture_record(pitch=-1.5),
        posture_record(right=Pointed((1.7, 1.0, 0.0))),
        posture_record(left=Pointed((0.0, -0.01, 0.0))),
        posture_record(left=Pointed((0.0, 2.3, 0.0))),
        posture_record(gesture=7),
        BOTH[:-1],
        BOTH + b"\0",
        b"VQ" + BOTH[2:],
        BOTH[:3] + b"\xff" + BOTH[4:],
        WHO,
        left_record(),
        b"",
    ],
)
def test_a_page_cannot_say_what_nobody_can_do_nor_who_it_is(record: bytes) -> None:
    assert posture_of(record) is None


@fuzz
@given(pieces(BOTH, BOTH[:6], BOTH[6:], WHO, WHO[:5], left_record(), b"VP\x01", struct.pack("<h", -32768)))
def test_fuzz_any_bytes_give_only_what_is_in_range_and_the_next_is_read(case: Case) -> None:
    for packet in variants(case):
        decoder = PointerDecoder("d")
        for frame in decoder.feed(packet, 1):
            assert abs(frame.head_yaw) <= MOST_YAW + 1e-6 and abs(frame.head_pitch) <= MOST_PITCH + 1e-6
            for hand in (frame.left, frame.right):
                assert max(abs(hand.palm.x), abs(hand.palm.z)) <= FARTHEST_M + 1e-6 and 0 <= hand.palm.y <= HIGHEST_M + 1e-6
                assert math.isfinite(hand.turn)
        assert len(decoder.feed(BOTH, 2)) == 1

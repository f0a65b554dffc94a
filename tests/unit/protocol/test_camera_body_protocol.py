"""What the camera of a guest's page sees, and anything else that might arrive in its place."""

from __future__ import annotations

import struct

import pytest
from fuzzing import Case, fuzz, pieces, variants
from hypothesis import given

from vistel.protocol.pages.camera_body import (
    BODY,
    FACE,
    FARTHEST,
    HAND_POINTS,
    MOST_BYTES,
    MOST_LATE_NS,
    CameraBodyDecoder,
    Seen,
    camera_body_of,
    camera_record,
)

NOW_NS = 10**18
HAND = [(-0.3 + 0.004 * n, 0.1 + 0.003 * n, -0.001 * n) for n in range(HAND_POINTS)]
ALL = Seen(
    [(0.05 * n, -0.04 * n, 0.1 * n - 0.4) for n in range(len(BODY))],
    [0.1 * n for n in range(len(BODY))],
    HAND,
    [(-x, y, z) for x, y, z in HAND],
    [(0.01 * n - 0.1, 0.2 - 0.01 * n, 0.002 * n) for n in range(len(FACE))],
)
RECORD = camera_record(NOW_NS, ALL, calibrating=True)


def test_a_record_says_what_was_seen_and_is_small() -> None:
    (frame,) = CameraBodyDecoder("ann-camera").feed(RECORD, NOW_NS + 5)
    assert (frame.device, frame.header.t_ns, frame.calibrating) == ("ann-camera", NOW_NS + 5, True)
    assert abs(frame.picture_t_ns - NOW_NS) < 1000
    assert list(frame.body[3:6]) == [500, -400, -300]
    assert frame.visibility[5] == round(0.5 * 255)
    for seen, told, most in (
        (ALL.left_hand, frame.left_hand, 6),
        (ALL.right_hand, frame.right_hand, 6),
        (ALL.face, frame.face, 14),
    ):
        assert max(abs(1e4 * x - y) for x, y in zip((v for p in seen for v in p), told, strict=True)) <= most
    assert len(RECORD) == MOST_BYTES and MOST_BYTES * 8 * 30 < 67_000  # with a voice of 29 kbit/s below 96


def test_what_is_not_seen_is_not_in_the_record() -> None:
    (frame,) = CameraBodyDecoder("d").feed(camera_record(NOW_NS, Seen()), NOW_NS)
    assert not (frame.body or frame.visibility or frame.left_hand or frame.face)
    (frame,) = CameraBodyDecoder("d").feed(camera_record(NOW_NS, Seen(ALL.body, right_hand=HAND)), NOW_NS)
    assert len(frame.body) == 3 * len(BODY) and len(frame.right_hand) == 3 * HAND_POINTS and not frame.left_hand


def _with(at: int, data: bytes) -> bytes:
    return RECORD[:at] + data + RECORD[at + len(data) :]


@pytest.mark.parametrize(
    "record",
    [
        RECORD[:-1],
        RECORD + b"\0",
        b"VQ" + RECORD[2:],
        _with(2, b"\x01"),
        _with(3, b"\xff"),  # parts that there are not
        _with(3, b"\x0e"),  # a face without a body
        _with(4, struct.pack("<d", float("nan"))),
        _with(4, struct.pack("<d", float("inf"))),
        _with(4, struct.pack("<d", NOW_NS * 1e-6 + 3_600_000.0)),  # from the future
        camera_record(NOW_NS - MOST_LATE_NS - 10**9, ALL),
        _with(12, struct.pack("<h", round(FARTHEST * 1e4) + 1)),  # a nose beside the picture
        _with(12 + 6 * len(BODY) + 4, struct.pack("<H", 0)),  # a hand without a size
        _with(12 + 6 * len(BODY) + 4, struct.pack("<H", 8001)),  # one larger than the picture
        _with(12 + 6 * len(BODY), struct.pack("<h", -32768)),
        b"VP\x05",
        b"",
    ],
)
def test_a_page_cannot_say_what_no_camera_sees(record: bytes) -> None:
    assert camera_body_of(record, NOW_NS) is None


@fuzz
@given(pieces(RECORD, RECORD[:12], RECORD[12:66], RECORD[66:], camera_record(NOW_NS, Seen()), b"VP\x05", struct.pack("<d", 1e300)))
def test_fuzz_any_bytes_give_only_what_a_picture_can_show_and_the_next_is_read(case: Case) -> None:
    for packet in variants(case):
        decoder = CameraBodyDecoder("d")
        for frame in decoder.feed(packet, NOW_NS):
            assert len(frame.body) in (0, 3 * len(BODY)) and len(frame.face) in (0, 3 * len(FACE))
            for points in (frame.body, frame.left_hand, frame.right_hand, frame.face):
                assert all(abs(v) <= 40_000 for v in points)
        assert len(decoder.feed(RECORD, NOW_NS)) == 1

"""What somebody shows live is cut into parts and put together again; where one is lost, the next key picture is waited for."""

from __future__ import annotations

from dataclasses import replace

import pytest
from screen_stream import ENCODERS, KEY_EVERY, plain, stream_of

from vistel.protocol.pages.screen_parts import (
    CODECS,
    MOST_PICTURE_BYTES,
    PART_BYTES,
    JoinedScreen,
    ScreenPicture,
    begins_as,
    parts_of,
)
from vistel.v1.motion_pb2 import ScreenPart
from vistel.wire.limits import SITE_BYTES


def picture(number: int, *, key: bool = False, size: int = 100, stream: int = 1) -> ScreenPicture:
    begin = b"\x10\0\0\x9d\x01\x2a" if key else b"\x11\0\0"
    return ScreenPicture(stream, number, key, "vp8", 320, 180, number * 100_000, begin + bytes(size))


def joined(screen: JoinedScreen, *pictures: ScreenPicture) -> list[int]:
    """Numbers of those that can be decoded."""
    return [p.number for whole in pictures for part in parts_of(whole) if (p := screen.take(part)) is not None]


@pytest.mark.parametrize("size", [1, PART_BYTES - 6, PART_BYTES, 5 * PART_BYTES + 1, MOST_PICTURE_BYTES - 6])
def test_a_picture_comes_out_as_it_was_and_no_message_is_too_large(size: int) -> None:
    whole, screen = picture(0, key=True, size=size), JoinedScreen()
    parts = list(parts_of(whole))
    assert all(part.ByteSize() < SITE_BYTES for part in parts)
    out = [screen.take(part) for part in parts]
    assert out[:-1] == [None] * (len(parts) - 1) and out[-1] == whole


def test_nothing_counts_before_a_key_picture_and_after_a_loss_until_the_next() -> None:
    screen = JoinedScreen()
    assert joined(screen, picture(3), picture(4), picture(5, key=True), picture(6)) == [5, 6]
    large = list(parts_of(picture(7, size=3 * PART_BYTES)))
    assert [screen.take(part) for part in (*large[:1], *large[2:])] == [None] * (len(large) - 1), "one of its parts was lost"
    assert joined(screen, picture(8), picture(9), picture(10, key=True), picture(11)) == [10, 11]
    assert joined(screen, picture(10, key=True), picture(11)) == [], "they come late"
    assert joined(screen, picture(0, stream=2), picture(1, key=True, stream=2)) == [1], "another stream begins anew"


@pytest.mark.parametrize(
    "wrong",
    [
        {"part": 1},
        {"parts": 0},
        {"parts": 4000, "data": bytes(PART_BYTES)},
        {"data": b""},
        {"data": bytes(PART_BYTES + 1)},
        {"parts": 2},  # a part that is not the last is whole
        {"number": (1 << 32) - 1},
        {"codec": "av01"},
        {"width": 4000},
        {"width": 1600, "height": 1600},
        {"height": 2},
    ],
)
def test_a_part_that_cannot_be_gives_nothing_and_those_after_it_are_whole(wrong: dict[str, object]) -> None:
    (right,) = parts_of(picture(1, key=True))
    fields = {
        name: getattr(right, name) for name in ("stream", "number", "part", "parts", "key", "codec", "width", "height", "data")
    }
    screen = JoinedScreen()
    assert screen.take(ScreenPart(**(fields | wrong))) is None
    assert joined(screen, picture(2, key=True), picture(3)) == [2, 3]


@pytest.mark.parametrize("codec", CODECS)
def test_pictures_of_real_encoders_begin_as_their_codec_does_and_as_no_other(codec: str) -> None:
    shades = (plain((10 * n, 80, 200 - 9 * n)) for n in range(KEY_EVERY + 2))
    stream = stream_of(codec, shades)
    assert [p.number for p in stream if p.key] == [0, KEY_EVERY]
    assert not any(p.objection for p in stream)
    assert [replace(p, key=True).objection for p in stream[1:KEY_EVERY]] == [f"what is no picture of the codec {codec}"] * (
        KEY_EVERY - 1
    )
    for other in ENCODERS.keys() - {codec}:
        assert not begins_as(other, stream[0].data, key=True)
    assert joined(JoinedScreen(), *stream) == list(range(KEY_EVERY + 2))

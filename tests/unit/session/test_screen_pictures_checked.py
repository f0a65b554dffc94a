"""A guest's stream of what they show live is held to its size, its rate and its order; the first picture that cannot be ends it."""

from __future__ import annotations

import pytest

from vistel.protocol.pages.screen import part_of, screen_record
from vistel.protocol.pages.screen_parts import MOST_PICTURE_BYTES, JoinedScreen
from vistel.session import guest_screen
from vistel.session.guest_screen import MOST_BYTES_S, MOST_PICTURES_S, GuestScreen, ScreenError
from vistel.session.screens import MOST_WAITING, ForwardedPicture, WaitingPictures

SAID = {"codec": "vp8", "width": 1280, "height": 720}
KEY, MORE = b"\x10\0\0\x9d\x01\x2a", b"\x11\0\0\0"
S_NS = 1_000_000_000


def sent(screen: GuestScreen, n: int, size: int = 1000, per_s: float = 10.0) -> int:
    """Parts of the picture with a number, which comes at its time."""
    key = n % 20 == 0
    record = screen_record(n + 1, (KEY if key else MORE) + bytes(size), key=key)
    return len(list(screen.records(record, round(n / per_s * S_NS))))


def test_what_is_in_order_goes_on_in_parts_that_give_the_same_pictures() -> None:
    screen, joined = GuestScreen(SAID, 5), JoinedScreen()
    out = []
    for n in range(40):
        data = (KEY if n % 20 == 0 else MORE) + bytes(50_000 if n % 20 == 0 else 900)
        for record in screen.records(screen_record(n + 1, data, key=n % 20 == 0), n * S_NS // 10):
            part = part_of(record)
            assert part is not None
            if (picture := joined.take(part)) is not None:
                out.append((picture.number, picture.key, picture.data == data, picture.stream, picture.width))
    assert out == [(n, n % 20 == 0, True, 5, 1280) for n in range(40)]


@pytest.mark.parametrize(
    ("said", "reason"),
    [
        ({"codec": "av01.0.05M.08"}, "codec"),
        ({"codec": "vp8\n" + "x" * 5000}, "codec"),
        ({"codec": 7}, "codec"),
        ({"width": 1601}, "pixels"),
        ({"width": 1600, "height": 1300}, "million"),
        ({"height": 0}, "pixels"),
        ({"width": 1280.0}, "whole pixels"),
        ({"width": None}, "whole pixels"),
        ({"height": True}, "whole pixels"),
    ],
)
def test_a_stream_that_cannot_be_is_refused_in_a_line(said: dict[str, object], reason: str) -> None:
    with pytest.raises(ScreenError, match=reason) as fault:
        GuestScreen(SAID | said, 1)
    assert "\n" not in str(fault.value) and len(str(fault.value)) < 200


@pytest.mark.parametrize(
    ("record", "reason"),
    [
        ("text", "no picture"),
        (b"", "no picture"),
        (b"VP", "no picture"),
        (screen_record(9, KEY, key=True)[:12], "no picture"),
        (b"VP\x04\0" + bytes(40), "no picture"),
        (screen_record(9, b"nothing of the kind", key=True), "codec vp8"),
        (screen_record(9, MORE, key=True), "codec vp8"),
        (screen_record(9, KEY + bytes(MOST_PICTURE_BYTES), key=True), "bytes"),
        (screen_record(1, MORE, key=False), "wrong order"),
    ],
)
def test_the_first_picture_that_cannot_be_ends_it(record: bytes | str, reason: str) -> None:
    screen = GuestScreen(SAID, 1)
    assert sent(screen, 0) == 1
    with pytest.raises(ScreenError, match=reason):
        list(screen.records(record, S_NS))


def test_a_stream_begins_with_a_key_picture() -> None:
    with pytest.raises(ScreenError, match="wrong order"):
        GuestScreen(SAID, 1).records(screen_record(1, MORE, key=False), 0)


def test_what_a_page_sends_goes_through_and_a_flood_of_bytes_or_of_pictures_does_not() -> None:
    page = GuestScreen(SAID, 1)
    for n in range(600):  # a minute at 1.5 Mbit/s
        sent(page, n, 187_500 // 10)
    large = GuestScreen(SAID, 1)
    with pytest.raises(ScreenError, match="Mbit/s"):
        for n in range(600):
            sent(large, n, 2 * MOST_BYTES_S // 10)
    many, went = GuestScreen(SAID, 1), 0
    with pytest.raises(ScreenError, match="pictures a second"):
        for went in range(6000):
            sent(many, went, 10, per_s=300.0)
    assert went <= guest_screen.MOST_PICTURES_AT_ONCE + MOST_PICTURES_S


def test_a_page_that_is_slow_gets_no_more_of_a_stream_until_its_next_key_picture() -> None:
    waiting = WaitingPictures()
    assert waiting.put([ForwardedPicture("ann", n == 0, bytes([n])) for n in range(MOST_WAITING)])
    assert not waiting.put([ForwardedPicture("ann", False, b"more")]), "nothing of it is of use without what came before"
    waiting.put(
        [ForwardedPicture("bob", True, b"bob"), ForwardedPicture("ann", True, b"key"), ForwardedPicture("ann", False, b"more")]
    )
    assert [waiting.next() for _ in range(3)] == [b"bob", b"key", b"more"]
    assert not waiting

"""What somebody shows live is decoded beside the drawing; what others send instead of it breaks nothing and costs little."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest
from screen_stream import KEY_EVERY, plain, stream_of

from vistel.protocol.pages.screen_parts import CODECS, MOST_PIXELS, ScreenPicture, parts_of
from vistel.render.stage import screens
from vistel.render.stage.screens import SILENT_NS, DecodedScreens

RED, GREEN, BLUE = (200, 30, 40), (20, 170, 60), (30, 50, 190)


def receive(decoded: DecodedScreens, *pictures: ScreenPicture, at_ns: int = 0) -> None:
    for picture in pictures:
        for part in parts_of(picture):
            decoded.receive("ann", part, at_ns)
    decoded.settle()


def seen(decoded: DecodedScreens, at_ns: int = 0) -> np.ndarray:
    """The colour of what is shown."""
    return decoded.shown(at_ns)["ann"].rgb.reshape(-1, 3).mean(axis=0)


@pytest.mark.parametrize("codec", CODECS)
def test_each_picture_of_a_stream_is_seen_as_it_was(codec: str) -> None:
    decoded, colours = DecodedScreens(), [RED, GREEN, BLUE]
    for n, picture in enumerate(stream_of(codec, map(plain, colours))):
        receive(decoded, picture)
        assert seen(decoded) == pytest.approx(colours[n], abs=8)
        assert decoded.shown(0)["ann"].number == n + 1
    assert decoded.shown(0)["ann"].rgb.shape == (180, 320, 3)
    assert not decoded.shown(SILENT_NS), "nothing has come for long"
    decoded.keep_only([])
    assert not decoded.shown(0)


@pytest.mark.parametrize("codec", CODECS)
def test_garbage_breaks_nothing_and_the_next_key_picture_is_seen(codec: str) -> None:
    draw = random.Random(3)
    decoded = DecodedScreens()
    stream = stream_of(codec, [plain(RED), plain(RED), *(plain(BLUE) for _ in range(KEY_EVERY))])
    receive(decoded, stream[0])
    head = 8 if codec.startswith("avc1") else 10
    for n in range(1, KEY_EVERY):  # as long as a picture, and begun as one
        rest = draw.randbytes(400)
        receive(decoded, replace(stream[n], data=stream[n].data[:head] + rest))
    receive(decoded, *stream[KEY_EVERY:])
    assert seen(decoded) == pytest.approx(BLUE, abs=8)


def test_a_stream_of_garbage_is_given_up_and_told_twice_and_another_one_is_seen(caplog: pytest.LogCaptureFixture) -> None:
    decoded = DecodedScreens()
    (key,) = stream_of("vp8", [plain(RED)])
    for n in range(10 * screens.MOST_FAULTS):
        receive(decoded, replace(key, number=n, data=key.data[:10]))
    assert not decoded.shown(0)
    assert sum("screen_not_decoded" in r.message for r in caplog.records) == 2
    receive(decoded, replace(key, number=1000))
    assert not decoded.shown(0), "it was given up"
    receive(decoded, replace(key, stream=8))
    assert seen(decoded) == pytest.approx(RED, abs=8)


@pytest.mark.parametrize("codec", CODECS)
def test_a_picture_larger_than_it_says_is_not_decoded(codec: str) -> None:
    decoded = DecodedScreens()
    (large,) = stream_of(codec, [plain(RED, 2560, 1440)])
    assert large.width * large.height > MOST_PIXELS
    receive(decoded, replace(large, width=320, height=180))
    assert not decoded.shown(0)
    (small,) = stream_of(codec, [plain(GREEN)], stream=8)
    receive(decoded, small)
    assert seen(decoded) == pytest.approx(GREEN, abs=8)


def test_more_than_can_be_decoded_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    import threading

    free, begun, count = threading.Event(), threading.Event(), []

    def decoded_slowly(self: object, picture: ScreenPicture) -> None:
        begun.set()
        free.wait()
        count.append(picture.number)

    monkeypatch.setattr(screens._Decoder, "decoded", decoded_slowly)
    decoded = DecodedScreens()
    stream = stream_of("vp8", (plain(RED) for _ in range(6 * KEY_EVERY)))
    for picture in stream:
        for part in parts_of(picture):
            decoded.receive("ann", part, 0)
    assert begun.wait(60)
    free.set()
    decoded.settle()
    assert count == sorted(count) and screens.MOST_WAITING <= len(count) <= screens.MOST_WAITING + 1
    decoded.keep_only([])

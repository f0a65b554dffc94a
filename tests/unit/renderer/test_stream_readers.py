"""A stream's queue and door: who does not keep up loses pictures and costs nothing, and pages of others are not let in."""

from __future__ import annotations

import asyncio
import itertools
import queue
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.conference.display import Display, StreamTls
from vistel.render.film.stream_encoder import KEY_PICTURE, StreamEncoder, StreamPicture
from vistel_services.renderer.out.stream_reader import MOST_PICTURES, MOST_SOUNDS, MOST_WORDS, Reader
from vistel_services.serving.address import PageAddress, answered


def received(reader: Reader, count: int) -> list[str | bytes]:
    async def read() -> list[str | bytes]:
        return [await asyncio.wait_for(reader.next(), 60.0) for _ in range(count)]

    return asyncio.run(read())


def test_a_reader_begins_with_a_key_picture() -> None:
    reader = Reader("h264")
    assert reader.wants_key
    reader.show(StreamPicture(b"delta", False))
    reader.show(StreamPicture(b"key", True))
    reader.show(StreamPicture(b"next", False))
    assert not reader.wants_key
    assert received(reader, 2) == [b"key", b"next"]
    assert reader.left_out == 1


def test_who_falls_behind_goes_on_with_a_key_picture_once_it_reads_again() -> None:
    reader = Reader("h264")
    reader.show(StreamPicture(b"key", True))
    for k in range(20):
        reader.show(StreamPicture(b"%d" % k, False))
    assert reader.wants_key
    reader.show(StreamPicture(b"again", True))
    reader.show(StreamPicture(b"after", False))
    assert received(reader, 2) == [b"again", b"after"]
    assert reader.left_out == 21


@given(st.lists(st.tuples(st.sampled_from("pkswl"), st.integers(0, 3)), max_size=300))
def test_whatever_comes_and_whoever_reads_little_waits_and_every_picture_follows_its_own(events: list[tuple[str, int]]) -> None:
    async def play() -> None:
        reader, shown, number = Reader("h264"), [], 0
        for kind, reads in events:
            number += 1
            if kind in "pk":
                reader.show(StreamPicture(b"%d" % number + kind.encode(), kind == "k"))
            elif kind == "s":
                number -= 1
                reader.play(b"sound")
            elif kind == "w":
                number -= 1
                reader.put_text("words")
            else:
                reader.lose()
            waiting = len(reader._pictures), len(reader._sounds), len(reader._words)
            assert all(n <= most for n, most in zip(waiting, (MOST_PICTURES, MOST_SOUNDS, MOST_WORDS), strict=True))
            for _ in range(min(reads, sum(waiting))):
                data = await reader.next()
                if isinstance(data, bytes) and data != b"sound":
                    shown.append((int(data[:-1]), data.endswith(b"k")))
        numbers = [n for n, _ in shown]
        assert numbers == sorted(numbers)
        assert all(key or n == before + 1 for (before, _), (n, key) in itertools.pairwise(shown))
        assert not shown or shown[0][1]

    asyncio.run(play())


def pictures_of(count: int) -> list[np.ndarray]:
    ramp = np.broadcast_to(np.linspace(0, 255, 64).astype(np.uint8)[None, :, None], (48, 64, 4)).copy()
    return [np.roll(ramp, 3 * k, axis=1) for k in range(count)]


def encoded(pictures: list[np.ndarray], apart_ns: int, wanted: set[int]) -> list[StreamPicture]:
    """H.264 of pictures, one after the other; wanted: at which ones a key picture is asked for."""
    done: queue.Queue[StreamPicture] = queue.Queue()
    encoder = StreamEncoder(64, 48, 30.0, lambda form, picture: done.put(picture))
    out: list[StreamPicture] = []
    for k, picture in enumerate(pictures):
        encoder.put(k * apart_ns, picture, {"h264"}, wants_key=k in wanted)
        out.append(done.get())
    encoder.close()
    return out


def test_pictures_come_out_as_they_went_in_with_key_pictures_where_they_are_wanted() -> None:
    pictures = pictures_of(40)
    out = encoded(pictures, 100_000_000, {25})
    assert [k for k, p in enumerate(out) if p.key] == [0, 25]
    assert out[0].data[0] == KEY_PICTURE
    decoder = av.CodecContext.create("h264", "r")
    # From the second key picture on, as somebody sees it who came late.
    decoded = [f for p in out[25:] for f in decoder.decode(av.Packet(p.data[16:]))] + decoder.decode(None)
    assert len(decoded) == 15
    for frame, picture in zip(decoded, pictures[25:], strict=True):
        error = frame.to_ndarray(format="rgb24").astype(float) - picture[::-1, :, :3]
        assert np.sqrt(np.mean(error**2)) < 12.0


def test_a_reader_that_always_wants_a_key_picture_gets_one_a_second() -> None:
    out = encoded(pictures_of(50), 50_000_000, set(range(50)))
    assert [k for k, p in enumerate(out) if p.key] == [0, 20, 40]


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        ("127.0.0.1:8090", None),
        ("127.0.0.1:8090", "http://127.0.0.1:8090"),
        ("localhost:8090", "http://localhost:8090"),
        ("[::1]:8090", "http://[::1]:8090"),
        ("192.168.1.7:8090", "http://192.168.1.7:8090"),
        ("localhost", "https://localhost"),
    ],
)
def test_its_own_page_and_programs_are_answered(host: str, origin: str | None) -> None:
    assert answered(host, origin)


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        (None, None),
        ("", None),
        ("evil.example:8090", None),
        ("evil.example:8090", "http://evil.example:8090"),
        ("127.0.0.1:8090", "http://evil.example"),
        ("127.0.0.1:8090", "http://127.0.0.1:9000"),
        ("127.0.0.1:8090", "null"),
        ("127.0.0.1:8090", "file://"),
        ("[bad", None),
        ("127.0.0.1.evil.example", None),
    ],
)
def test_pages_of_others_are_not(host: str | None, origin: str | None) -> None:
    assert not answered(host, origin)


def test_names_of_its_certificate_are_its_own_and_a_star_stands_for_one_label() -> None:
    names = frozenset({"tokyo.example.org", "*.meet.example.org"})
    assert answered("tokyo.example.org:8090", "https://tokyo.example.org:8090", names)
    assert answered("a.meet.example.org", None, names)
    for host in ("tokyo.example.org.evil.example", "a.b.meet.example.org", "meet.example.org", "example.org"):
        assert not answered(host, None, names)


@given(st.text(max_size=30), st.none() | st.text(max_size=30))
def test_no_header_can_break_the_door(host: str, origin: str | None) -> None:
    answered(host, origin)


@pytest.mark.parametrize(
    ("said", "at", "local"),
    [
        ("8090", ("127.0.0.1", 8090), True),
        ("0.0.0.0:8090", ("0.0.0.0", 8090), False),
        ("[::1]:80", ("::1", 80), True),
        ("studio.local:8090", ("studio.local", 8090), False),
        ("localhost:0", ("localhost", 0), True),
    ],
)
def test_a_port_alone_is_of_this_machine(said: str, at: tuple[str, int], local: bool) -> None:
    assert Display(stream=said, stream_token="" if local else "0123456789abcdef").stream_at == at
    assert PageAddress(*at).local is local
    if not local:
        with pytest.raises(ValueError, match="expected stream_token"):
            Display(stream=said)


def test_beyond_this_machine_the_page_is_https_unless_plain_is_meant_and_its_address_holds_no_token(tmp_path: Path) -> None:
    token, files = "0123456789abcdef", StreamTls(certificate=tmp_path / "c.pem", key=tmp_path / "c.key")

    def page(stream: str, **more: Any) -> str:
        return Display(stream=stream, stream_token=token, **more).stream_page

    assert page("8090") == "http://127.0.0.1:8090/"
    assert page("8090", stream_tls=files) == "https://127.0.0.1:8090/"
    assert page("192.168.1.7:8090") == "https://192.168.1.7:8090/"
    assert page("0.0.0.0:8090", stream_tls=files) == "https://127.0.0.1:8090/"
    assert page("192.168.1.7:8090", stream_insecure=True) == "http://192.168.1.7:8090/"
    with pytest.raises(ValueError, match="leave one of them out"):
        page("0.0.0.0:8090", stream_insecure=True, stream_tls=files)


@pytest.mark.parametrize("said", ["no", "host:", ":8090", "1.2.3.4:99999", "http://1.2.3.4:80", "::1:80"])
def test_what_is_no_address_is_refused_with_what_was_expected(said: str) -> None:
    with pytest.raises(ValueError, match=r"127\.0\.0\.1:8090"):
        Display(stream=said)

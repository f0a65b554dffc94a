"""The simulated CyberGlove does what its guide says, without a port."""

from __future__ import annotations

import pytest

from vistel.protocol.cyberglove import MASKS, CyberGloveParser
from vistel_sim.cyberglove import CyberGlove

HAND = [0.1, 0.05, 0.2, 0.3, 0.4, 0.1, 0.6, 0.4, 0.5, 0.0, 0.6, 0.4, 0.6, -0.05, 0.6, 0.4, 0.7, -0.1, 0.6, 0.4]


def glove(sensors: int = 18, **options: float) -> CyberGlove:
    return CyberGlove(lambda t_s: HAND, sensors=sensors, **({"noise": 0.0} | options))  # type: ignore[arg-type]


def said(g: CyberGlove, command: bytes, t_s: float = 0.0) -> bytes:
    return b"".join(r.data for r in g.receive(command, t_s))


@pytest.mark.parametrize("sensors", [18, 22])
def test_queries_are_answered_with_their_prefix(sensors: int) -> None:
    g = glove(sensors, right=True)
    assert said(g, b"?G?S?R") == b"?G\x03\0?S" + bytes((sensors,)) + b"\0?R\x01\0"
    assert said(g, b"?K") == b"?K" + MASKS[sensors] + b"\0"
    assert b"CyberGlove" in said(g, b"?i")
    assert said(g, b"%") == b" e?\r\n\0"


def test_one_sample_on_request_and_a_stream_until_stopped() -> None:
    g = glove()
    assert g.next_length() == 0
    said(g, b"G")
    assert g.next_length() == 20
    assert g.measure(0.0)[:1] == b"G" and g.next_length() == 0
    said(g, b"S")
    assert g.measure(0.0)[:1] == b"S" and g.next_length() == 20
    assert said(g, b"\x03") == b"\x03\0" and g.next_length() == 0
    said(g, b"S")
    assert said(g, b"^c") == b"\x03\0" and g.next_length() == 0


@pytest.mark.parametrize(("words", "hz"), [(b"1152 1", 100), (b"1920 1", 60), (b"57600 2", 1), (b"0 1", 150)])
def test_the_rate_follows_its_words(words: bytes, hz: float) -> None:
    g = glove()
    said(g, b"t " + words + b"\rS")
    assert 1.0 / g.period_s == pytest.approx(hz)


def test_status_and_time_are_added_when_switched_on_and_no_byte_is_zero() -> None:
    g = glove()
    assert said(g, b"U\x01D\x01") == b"U\0D\0"
    said(g, b"S")
    parser = CyberGloveParser(18, timestamp=True)
    for t_s in (0.0, 0.256, 65.536, 3600.0):
        data = g.measure(t_s)
        assert len(data) == 26 and data.index(0) == 25
        (sample,) = parser.feed(data, 10**9)
        assert sample.status == 0x81
    assert said(g, b"?U") == b"?U\x01\0"


def test_a_sample_as_text() -> None:
    g = glove(22)
    said(g, b"g\r")
    words = g.measure(0.0).rstrip(b"\r\n\0").split()
    assert words[0] == b"g" and len(words) == 23


def test_restart_answers_late_and_forgets() -> None:
    g = glove(restart_s=1.75)
    said(g, b"U\x01S")
    (reply,) = g.receive(b"\x12", 1.0)
    assert reply.data == b"\x12\r\n\0" and reply.delay_s == 1.75
    assert said(g, b"?G", 2.0) == b"" and g.next_length() == 0
    assert said(g, b"?U", 2.8) == b"?U\0\0"


def test_a_binary_argument_may_come_in_pieces() -> None:
    g = glove()
    assert said(g, b"M\x3f") == b"" and said(g, b"\xbb\x7b") == b"M\0"


def test_an_unplugged_glove_is_reported() -> None:
    g = glove()
    g.plugged = False
    assert said(g, b"?G") == b"?G\x01\0"
    said(g, b"U\x01S")
    (sample,) = CyberGloveParser(18).feed(g.measure(0.0), 10**9)
    assert sample.error == "glove unplugged"


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        (b"\x03", b"\x03\0"),
        (b"\x09", b"\x09\0"),
        (b"?G", b"?G\x03\0"),
        (b"?S", b"?S\x12\0"),
        (b"?N", b"?N\x12\0"),
        (b"?R", b"?R\0\0"),
        (b"?K", b"?K\x3f\xbb\x7b\0"),
        (b"M\x01\x02\x03?M", b"M\0?M\x01\x02\x03\0"),
        (b"?P", b"?P\x93\0\0\0"),
        (b"U\x01?P", b"U\0?P\x97\0\0\0"),
        (b"?i", b"?iCyberGlove 18 sensors"),
        (b"?v", b"?vVersion 2.50"),
        (b"?V", b"?V2.50\0"),
        (b"N\x0a?N", b"N\0?N\x0a\0"),
        (b"T\x80\x07\x01\x00?T", b"T\0?T\x80\x07\x01\x00\0"),
        (b"t 1920 1\r?T", b"\r\0?T\x80\x07\x01\x00\0"),
        (b"u 1\r?U", b"\r\0?U\x01\0"),
        (b"f 0\r?F", b"\r\0?F\0\0"),
        (b"d 1\r?D", b"\r\0?D\x01\0"),
        (b"L\x01?L", b"L\0?L\x01\0"),
        (b"J\x01?J", b"J\0?J\x01\0"),
        (b"W\x01?W", b"W\0?W\x01\0"),
        (b"q", b" e?\r\n\0"),
    ],
)
def test_every_command_of_the_guide_is_answered(command: bytes, reply: bytes) -> None:
    assert said(glove(), command).startswith(reply)

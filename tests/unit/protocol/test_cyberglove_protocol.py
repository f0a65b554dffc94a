"""CyberGlove bytes to samples and answers."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.protocol import cyberglove
from vistel.protocol.cyberglove import SENSORS_18, SENSORS_22, CyberGloveParser

VALUES = bytes(range(60, 78))


def sample(values: bytes = VALUES, status: bytes = b"\x83", head: bytes = b"S") -> bytes:
    return head + values + status + b"\0"


def test_sensor_lists_have_their_lengths_and_order() -> None:
    assert len(SENSORS_22) == 22 and len(SENSORS_18) == 18
    assert SENSORS_22[10] == "middle_index_abduction" and SENSORS_22[19] == "palm_arch"
    for count, mask in cyberglove.MASKS.items():
        assert sum(byte.bit_count() for byte in mask) == count


def test_a_sample_is_read() -> None:
    (s,) = CyberGloveParser(18).feed(sample(), 10**9)
    assert s.values == VALUES and s.status == 0x83 and s.error == ""
    assert s.t_ns == pytest.approx(10**9 - 21 * 10 / 115200 * 1e9, abs=2)


def test_a_glove_without_status_byte_is_read() -> None:
    (s,) = CyberGloveParser(22, status=False).feed(sample(bytes(range(1, 23)), b"", b"G"), 10**9)
    assert s.values == bytes(range(1, 23)) and s.status is None


def test_time_bytes_are_stepped_over() -> None:
    (s,) = CyberGloveParser(18, timestamp=True).feed(b"S" + VALUES + b"\x80\x01\x02\x03\x04" + b"\x83\0", 10**9)
    assert s.values == VALUES


def test_header_letters_are_legal_values() -> None:
    (s,) = CyberGloveParser(18).feed(sample(b"SG" * 9), 10**9)
    assert s.values == b"SG" * 9


def test_garbage_before_a_sample_does_not_cost_it() -> None:
    parser = CyberGloveParser(18)
    out = parser.feed(b"\x07\x00" + b"junkS" + sample() + sample(), 10**9)
    assert len(out) == 2 and parser.bytes_skipped == 7


def test_a_sample_cut_in_half_costs_only_itself() -> None:
    parser = CyberGloveParser(18)
    out = parser.feed(sample() + sample()[:9] + sample() + sample()[9:] + sample(), 10**9)
    assert [s.values for s in out] == [VALUES] * 3


def test_error_tail_is_reported() -> None:
    out = CyberGloveParser(18).feed(b"S" + VALUES + b"\x82eg\0" + b"S" + VALUES + b"\x83es\0", 10**9)
    assert [s.error for s in out] == ["glove unplugged", "sampling too fast"]


def test_answers_may_hold_zeros() -> None:
    parser = CyberGloveParser(18)
    parser.feed(b"?U\0\0?M\0\xff\0\0?S\x12\0U\0\x03\0\x12\r\n\0?iCyberGlove 18\r\n\0 e?\r\n\0\r\0", 10**9)
    assert [(a.name, a.data) for a in parser.take_answers()] == [
        ("?U", b"\0"),
        ("?M", b"\0\xff\0"),
        ("?S", b"\x12"),
        ("U", b""),
        ("^C", b""),
        ("^R", b"\r\n"),
        ("?i", b"CyberGlove 18\r\n"),
        ("error", b"e?\r\n"),
        ("", b"\r"),
    ]
    assert parser.bytes_skipped == 0


def test_an_ascii_answer_may_precede_the_stream() -> None:
    parser = CyberGloveParser(18)
    assert len(parser.feed(b"\r\n" + sample(), 10**9)) == 1
    assert parser.bytes_skipped == 0


def test_what_holds_no_zero_does_not_pile_up() -> None:
    parser = CyberGloveParser(18)
    for _ in range(100):
        parser.feed(b"\x55" * 100, 10**9)
    assert parser.bytes_skipped >= 10_000 - 400
    assert len(parser.feed(b"\0" + sample(), 10**9)) == 1


def test_rate_is_set_as_text() -> None:
    assert cyberglove.set_rate(60.0) == b"t 1920 1\r"


@given(
    st.lists(st.one_of(st.binary(max_size=40), st.just(sample()), st.just(b"?P\x01\0\0\0")), max_size=8),
    st.lists(st.integers(1, 50), min_size=1),
)
def test_how_the_bytes_are_cut_into_reads_changes_nothing(parts: list[bytes], cuts: list[int]) -> None:
    data = b"".join(parts)
    whole, pieces = CyberGloveParser(18), CyberGloveParser(18)
    expected = [s.values for s in whole.feed(data, 10**9)]
    out, i, k = [], 0, 0
    while i < len(data):
        step = cuts[k % len(cuts)]
        out += [s.values for s in pieces.feed(data[i : i + step], 10**9)]
        i, k = i + step, k + 1
    assert out == expected and pieces.take_answers() == whole.take_answers()

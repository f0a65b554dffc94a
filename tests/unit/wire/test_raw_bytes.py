"""Bytes of a device's wire keep their times and their order through the messages that carry them."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from vistel.v1.device_pb2 import RawBytes
from vistel.wire.raw_bytes import GATHER_NS, RawGatherer, reads_of

FROM, TO = RawBytes.DIRECTION_FROM_DEVICE, RawBytes.DIRECTION_TO_DEVICE
READS = st.lists(st.tuples(st.binary(min_size=1, max_size=60), st.integers(-GATHER_NS, 3 * GATHER_NS), st.sampled_from((FROM, TO))))


def gather(reads: list[tuple[bytes, int, RawBytes.Direction]]) -> list[RawBytes]:
    out: list[RawBytes] = []
    gatherer = RawGatherer("ada-tracker", out.append)
    for data, t_ns, direction in reads:
        gatherer.add(data, t_ns, direction)
    gatherer.flush()
    gatherer.flush()
    return [RawBytes.FromString(m.SerializeToString()) for m in out]


@given(READS)
def test_what_was_read_comes_out_again_whatever_the_clock_does(steps: list[tuple[bytes, int, RawBytes.Direction]]) -> None:
    t_ns, reads = 10**12, []
    for data, step_ns, direction in steps:
        t_ns += step_ns
        reads.append((data, t_ns, direction))
    assert [(data, t, m.direction) for m in gather(reads) for t, data in reads_of(m)] == reads


def test_a_busy_wire_needs_ten_messages_a_second() -> None:
    assert 10 <= len(gather([(b"0 1", k * 4_000_000, FROM) for k in range(250)])) <= 11


def test_a_message_of_one_read_without_sizes_is_understood() -> None:
    message = RawBytes(data=b"xyz")
    message.header.t_ns = 5
    assert list(reads_of(message)) == [(5, b"xyz")]


def test_sizes_that_do_not_fit_the_bytes_end_the_message() -> None:
    message = RawBytes(data=b"xyz", read_size=[2, 2], read_after_ns=[0, 1])
    assert list(reads_of(message)) == [(0, b"xy")]

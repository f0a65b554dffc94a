"""Logs: whole, cut off, broken in the middle, and from any time."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from vistel.v1.command_pb2 import Command
from vistel.v1.motion_pb2 import Motion
from vistel.v1.service_pb2 import ClockOffset
from vistel.wire.log import LogError, LogReader, LogWriter
from vistel.wire.log_index import read_index
from vistel.wire.topics import BY_NAME

START_NS = 1_700_000_000_000_000_000
MS = 1_000_000
KEYS = [f"vistel/demo/site/tokyo/participant/{name}/motion" for name in ("ann", "ben")]
CONFERENCE = 'name = "demo"\n[[sites]]\nname = "tokyo"\n'


def motion(n: int) -> Motion:
    message = Motion(body=[(n * 7919 + i * 104729) % 5000 for i in range(25)])
    message.header.version, message.header.seq, message.header.t_ns = 1, n + 1, START_NS + n * 5 * MS
    return message


def write(path: Path, count: int, *, close: bool = True) -> None:
    """`count` messages, 5 ms apart, arriving 2 ms late, by turns of two people."""
    writer = LogWriter(path, conference=CONFERENCE)
    for n in range(count):
        writer.write(BY_NAME["motion"], KEYS[n % 2], motion(n), START_NS + n * 5 * MS + 2 * MS)
    if close:
        writer.close()
    else:
        writer._file.close()  # as the operating system does for a process that is killed


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "whole.mcap"
    write(path, 4000)
    return path


def test_everything_comes_back_in_order_with_its_times_and_conference(whole: Path) -> None:
    reader = LogReader(whole)
    records = list(reader.records())
    assert [r.message.header.seq for r in records] == list(range(1, 4001))
    assert records[7].message == motion(7)
    assert (records[7].key, records[7].names["participant"], records[7].topic.name) == (KEYS[1], "ben", "motion")
    assert records[7].log_ns == START_NS + 37 * MS
    assert (reader.begin_ns, reader.end_ns) == (records[0].log_ns, records[-1].log_ns)
    assert reader.conference == {"name": "demo", "sites": [{"name": "tokyo"}]}
    assert reader.damage == []


def test_while_it_is_read_a_log_tells_how_far(whole: Path) -> None:
    reader = LogReader(whole)
    shares = [reader.share_read for _ in reader.records()]
    assert shares == sorted(shares) and shares[0] == 0.0 and 0.9 < shares[-1] <= 1.0


def test_the_file_carries_its_schemas_for_other_readers(whole: Path) -> None:
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        assert {s.name: s.encoding for s in summary.schemas.values()} == {"vistel.v1.Motion": "protobuf"}
        assert summary.statistics is not None
        assert summary.statistics.message_count == 4000
        _, _, message = next(make_reader(file).iter_messages())
        assert message.publish_time == START_NS


def test_reading_starts_and_ends_at_any_time(whole: Path) -> None:
    reader = LogReader(whole)
    for begin in (0, 1, 999, 3990):
        got = list(reader.records(begin_ns=START_NS + begin * 5 * MS, end_ns=START_NS + (begin + 20) * 5 * MS))
        assert [r.message.header.seq for r in got] == list(range(begin + 1, min(begin + 20, 4000) + 1))


def test_reading_can_be_limited_to_topics(tmp_path: Path) -> None:
    path = tmp_path / "two.mcap"
    with LogWriter(path) as writer:
        command = Command(id="1")
        command.header.version = 1
        writer.write(BY_NAME["motion"], KEYS[0], motion(0), START_NS)
        writer.write(BY_NAME["command"], "vistel/demo/site/tokyo/participant/ann/command", command, START_NS + 1)
    reader = LogReader(path)
    assert [r.topic.name for r in reader.records(topics=("command",))] == ["command"]
    assert len(list(reader.records())) == 2
    assert reader.conference is None


def test_messages_that_arrived_out_of_order_are_read_in_order(tmp_path: Path) -> None:
    path = tmp_path / "mixed.mcap"
    times = [START_NS + (n ^ 3) * 700 * MS for n in range(64)]
    with LogWriter(path) as writer:
        for n, t in enumerate(times):
            writer.write(BY_NAME["motion"], KEYS[0], motion(n), t)
    assert [r.log_ns for r in LogReader(path).records()] == sorted(times)


def test_a_channel_that_is_there_twice_is_read_as_one(tmp_path: Path) -> None:
    path = tmp_path / "twice.mcap"
    with LogWriter(path) as writer:
        for n in range(40):
            if n == 20:
                writer._channels.clear()  # as a program that begins a channel anew
            writer.write(BY_NAME["motion"], KEYS[0], motion(n), START_NS + n * 5 * MS)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        assert [c.topic for c in summary.channels.values()] == [KEYS[0]] * 2
    reader = LogReader(path)
    assert [r.message.header.seq for r in reader.records()] == list(range(1, 41))
    assert reader.damage == []


@settings(max_examples=40, deadline=None)
@given(share=st.floats(0.0, 1.0))
def test_a_log_cut_anywhere_gives_what_is_whole_and_says_what_is_missing(whole: Path, share: float) -> None:
    data = whole.read_bytes()
    cut = whole.with_name("cut.mcap")
    size = min(int(len(data) * share), len(data) - 1)
    cut.write_bytes(data[:size])
    if size < 8:
        with pytest.raises(LogError, match="is not an MCAP log"):
            LogReader(cut)
        return
    reader = LogReader(cut)
    got = [r.message.header.seq for r in reader.records()]
    assert got == list(range(1, len(got) + 1))
    with whole.open("rb") as file:
        last_whole = [c for c in read_index(file, len(data)).chunks if c.offset < size]
    assert len(last_whole) <= 1 or got
    inside_the_index = len(got) == 4000
    if not inside_the_index:
        (line,) = reader.damage
        assert f"of {size} bytes at the end are not readable" in line
        if got:
            assert f"the last whole message is at {(len(got) - 1) * 0.005:.3f} s" in line
            middle = START_NS + len(got) // 2 * 5 * MS
            assert next(reader.records(begin_ns=middle)).message.header.seq == len(got) // 2 + 1


def test_a_recorder_that_is_killed_loses_a_second_at_most(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    write(path, 2000, close=False)
    reader = LogReader(path)
    got = list(reader.records())
    assert 2000 - len(got) <= 200
    assert "cut off" in reader.damage[0]
    assert reader.conference is not None


def test_a_broken_chunk_costs_its_own_messages_only(whole: Path) -> None:
    with whole.open("rb") as file:
        chunks = read_index(file, whole.stat().st_size).chunks
    data = bytearray(whole.read_bytes())
    for i in range(200):
        data[chunks[2].offset + 500 + i] ^= 0x5A
    broken = whole.with_name("broken.mcap")
    broken.write_bytes(data)
    reader = LogReader(broken)
    got = {r.log_ns for r in reader.records()}
    lost = [t for t in (START_NS + n * 5 * MS + 2 * MS for n in range(4000)) if t not in got]
    assert lost
    assert all(chunks[2].begin_ns <= t <= chunks[2].end_ns for t in lost)
    assert f"a chunk at byte {chunks[2].offset} is broken" in reader.damage[0]


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_bytes_changed_anywhere_never_stop_the_reader(whole: Path, data: st.DataObject) -> None:
    content = bytearray(whole.read_bytes())
    for at in data.draw(st.lists(st.integers(8, len(content) - 1), min_size=1, max_size=20)):
        content[at] = data.draw(st.integers(0, 255))
    path = whole.with_name("changed.mcap")
    path.write_bytes(content)
    try:
        reader = LogReader(path)
    except LogError:
        return
    for record in reader.records():
        assert record.topic.name


def test_what_is_no_log_is_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"absent\.mcap: cannot be read: No such file"):
        LogReader(tmp_path / "absent.mcap")
    (tmp_path / "text.mcap").write_text("hello, this is no log\n" * 10)
    with pytest.raises(LogError, match=r"text\.mcap: is not an MCAP log"):
        LogReader(tmp_path / "text.mcap")
    (tmp_path / "empty.mcap").write_bytes(b"")
    with pytest.raises(LogError, match="it is empty"):
        LogReader(tmp_path / "empty.mcap")


def test_messages_of_a_later_version_are_left_out_and_reported(tmp_path: Path) -> None:
    path = tmp_path / "future.mcap"
    with LogWriter(path) as writer:
        later = motion(0)
        later.header.version = 2
        writer.write(BY_NAME["motion"], KEYS[0], later, START_NS)
        writer.write(BY_NAME["motion"], KEYS[0], motion(1), START_NS + 1)
    reader = LogReader(path)
    assert [r.message.header.seq for r in reader.records()] == [2]
    assert "version 2, this is 1" in reader.damage[0]


def test_the_clock_offsets_of_the_nodes_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "offsets.mcap"
    with LogWriter(path) as writer:
        offset = ClockOffset(node="capture", offset_ns=-1234, uncertainty_ns=56)
        offset.header.version, offset.header.t_ns = 1, START_NS
        writer.write(BY_NAME["clock_offset"], "vistel/demo/site/tokyo/node/capture/clock", offset, START_NS)
    assert LogReader(path).clock_offsets == {"capture": f"-1234 ns +- 56 ns at {START_NS}"}


def test_an_empty_log_is_a_log(tmp_path: Path) -> None:
    path = tmp_path / "none.mcap"
    LogWriter(path, conference=CONFERENCE).close()
    reader = LogReader(path)
    assert list(reader.records()) == []
    assert reader.damage == []
    assert reader.conference is not None


def test_a_log_that_grows_for_long_keeps_little_of_its_index_in_memory(tmp_path: Path) -> None:
    """A chunk a second with seventy channels; kept as objects, an entry of the index takes 4.5 kB."""
    keys = [f"vistel/demo/site/tokyo/participant/p{n}/motion" for n in range(70)]
    message = motion(0)
    with LogWriter(tmp_path / "long.mcap") as writer:

        def go_on(first: int, last: int) -> None:
            for second in range(first, last):
                for n, key in enumerate(keys):
                    writer.write(BY_NAME["motion"], key, message, START_NS + second * 1000 * MS + n)

        go_on(0, 20)
        tracemalloc.start()
        before, _ = tracemalloc.get_traced_memory()
        go_on(20, 220)
        after, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert after - before < 200 * 800
    with (tmp_path / "long.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None and len(summary.chunk_indexes) >= 219
        assert all(len(chunk.message_index_offsets) == 70 for chunk in summary.chunk_indexes[:200])
    assert sum(1 for _ in LogReader(tmp_path / "long.mcap").records()) == 220 * 70


def test_the_index_says_of_each_chunk_what_mcaps_own_reader_says(tmp_path: Path) -> None:
    """Of three hundred channels, whose ids take two bytes, in sets that change from chunk to chunk."""
    path = tmp_path / "many.mcap"
    with LogWriter(path) as writer:
        for second in range(40):
            for n in range(300):
                if n % 40 != second and (n < 290 or second % 3):
                    key = f"vistel/demo/site/tokyo/participant/p{n}/motion"
                    writer.write(BY_NAME["motion"], key, motion(0), START_NS + second * 1000 * MS + n)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None and len(summary.chunk_indexes) >= 40
        theirs = [
            (c.chunk_start_offset, c.message_start_time, c.message_end_time, set(c.message_index_offsets))
            for c in summary.chunk_indexes
        ]
        file.seek(0)
        ours = read_index(file, path.stat().st_size).chunks
    assert [(c.offset, c.begin_ns, c.end_ns, c.channels) for c in ours] == theirs
    assert len({c.channels for c in ours}) > 20 and max(max(c.channels or ()) for c in ours) > 255

"""Logs as long as wanted: the recorded meeting of the tests over and over."""

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import lz4.frame
import numpy as np
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Attachment, Chunk, ChunkIndex, DataEnd, Footer, Header, MessageIndex, Statistics
from mcap.records import AttachmentIndex as AttachmentPlace

from vistel.arrays import I64
from vistel.wire.log import CONFERENCE_FILE, LogReader, LogRecord, LogWriter
from vistel.wire.log_index import MAGIC, read_index

MEETING = Path(__file__).resolve().parents[2] / "tests/replay/meeting.mcap"
"""Two people with a FASTRAK and two CyberGloves each."""
_SAID_ONCE = "participant"
"""A conference says it once."""
_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_TIMES_AT = 6, 14
"""Where the times of a message stand in its record, after channel and sequence."""
_HEADER_BYTES = 40
"""Of a message, in which the time of its own header stands."""


def long_log(path: Path, seconds: float) -> Path:
    """A log of so many seconds at `path`."""
    reader = LogReader(MEETING)
    records = [r for r in reader.records() if r.topic.name != _SAID_ONCE]
    length_ns = reader.end_ns - reader.begin_ns + 1
    with LogWriter(path, reader.conference_toml) as writer:
        for about in reader.records((_SAID_ONCE,)):
            writer.write(about.topic, about.key, about.message, reader.begin_ns)
        for _ in range(round(seconds * 1e9 / length_ns)):
            _append(writer, records, length_ns)
    return path


def _append(writer: LogWriter, records: list[LogRecord], length_ns: int) -> None:
    """The meeting once more, and `records` as much later."""
    for r in records:
        writer.write(r.topic, r.key, r.message, r.message.header.t_ns)
        r.message.header.t_ns += length_ns


def large_log(path: Path, size: int) -> Path:
    """A log of at least so many bytes at `path`, written a chunk at a time, which is quicker than a message at a time."""
    reader = LogReader(MEETING)
    length_ns = reader.end_ns - reader.begin_ns + 1
    with MEETING.open("rb") as file:
        index = read_index(file, MEETING.stat().st_size)
        file.seek(0)
        summary = make_reader(file).get_summary()
        assert summary is not None
        once = frozenset(n for n, c in index.channels.items() if reader.keys[c.topic][0].name == _SAID_ONCE)
        chunks = [_chunk_at(file, place.offset) for place in index.chunks]
    with path.open("wb") as out:
        writer = _ChunkWriter(out, (reader.conference_toml or "").encode())
        for chunk in chunks:
            writer.put(_Part.of(chunk, frozenset()), 0)
        parts = [part for chunk in chunks if len((part := _Part.of(chunk, once)).channels)]
        turn = 1
        while out.tell() < size:
            for part in parts:
                writer.put(part, turn * length_ns)
            turn += 1
        writer.close([*summary.schemas.values(), *summary.channels.values()])
    return path


def _chunk_at(file: BinaryIO, offset: int) -> bytes:
    """What a chunk holds."""
    file.seek(offset + _RECORD.size)
    return lz4.frame.decompress(Chunk.read(ReadDataStream(file)).data)


@dataclass(frozen=True)
class _Part:
    """A chunk's messages. data: their records; channels, places: (n,) of each message the id of its channel, and where its record
    begins; log_at: (n,) where its log time stands; times_at: (m,) where any time of it stands [byte]."""

    data: bytes
    channels: I64
    places: I64
    log_at: I64
    times_at: I64

    @classmethod
    def of(cls, chunk: bytes, without: frozenset[int]) -> "_Part":
        """without: ids of channels whose messages are left out, and then all that is no message, too."""
        data, channels, places, times_at = bytearray(), list[int](), list[int](), list[int]()
        at = 0
        while at < len(chunk):
            kind, length = _RECORD.unpack_from(chunk, at)
            record = chunk[at : at + _RECORD.size + length]
            at += len(record)
            body = _RECORD.size + _MESSAGE.size
            if kind == Opcode.MESSAGE:
                channel, _, _, publish_ns = _MESSAGE.unpack_from(record, _RECORD.size)
                if channel in without:
                    continue
                channels.append(channel)
                places.append(len(data))
                times_at += [len(data) + _RECORD.size + k for k in _TIMES_AT]
                own = record.find(struct.pack("<Q", publish_ns), body, body + _HEADER_BYTES)
                times_at += [len(data) + own] if own >= 0 else []
            elif without:
                continue
            data += record
        starts = np.array(places, np.int64)
        return cls(
            bytes(data), np.array(channels, np.int64), starts, starts + _RECORD.size + _TIMES_AT[0], np.array(times_at, np.int64)
        )

    def later(self, by_ns: int) -> bytes:
        """The records with all times so much later."""
        out = np.frombuffer(self.data, np.uint8).copy()
        rows = self.times_at[:, None] + np.arange(8)
        times = np.ascontiguousarray(out[rows]).view("<u8") + np.uint64(by_ns)
        out[rows] = times.view(np.uint8)
        return out.tobytes()


class _ChunkWriter:
    """An MCAP file of whole chunks (the format's specification, "Records")."""

    def __init__(self, out: BinaryIO, conference: bytes) -> None:
        self._out = out
        self._entries: list[ChunkIndex] = []
        self._counts: dict[int, int] = {}
        out.write(MAGIC)
        self._write(Header(profile="vistel", library="vistel"))
        self._attached_at = out.tell()
        self._attachment = Attachment(0, 0, CONFERENCE_FILE, "application/toml", conference)
        self._attached = self._write(self._attachment)

    def put(self, part: _Part, by_ns: int) -> None:
        """A chunk of messages, so much later than they were."""
        data = part.later(by_ns)
        log_ns = np.ascontiguousarray(np.frombuffer(data, np.uint8)[part.log_at[:, None] + np.arange(8)]).view("<u8")[:, 0]
        begin_ns, end_ns, packed = int(log_ns.min()), int(log_ns.max()), lz4.frame.compress(data)
        begin = self._out.tell()
        length = self._write(Chunk("lz4", packed, end_ns, begin_ns, zlib.crc32(data), len(data)))
        places, indexed = dict[int, int](), self._out.tell()
        for channel in np.unique(part.channels).tolist():
            of = part.channels == channel
            places[channel] = self._out.tell()
            self._counts[channel] = self._counts.get(channel, 0) + int(of.sum())
            self._write(MessageIndex(channel, list(zip(log_ns[of].tolist(), part.places[of].tolist(), strict=True))))
        sizes = {"compressed_size": len(packed), "uncompressed_size": len(data), "compression": "lz4"}
        times = {"message_start_time": begin_ns, "message_end_time": end_ns}
        rest = {"message_index_offsets": places, "message_index_length": self._out.tell() - indexed}
        self._entries.append(ChunkIndex(chunk_start_offset=begin, chunk_length=length, **sizes, **times, **rest))

    def close(self, described: list) -> None:
        """Write the index. described: schemas and channels."""
        self._write(DataEnd(0))
        begin = self._out.tell()
        kinds = [type(d).__name__ for d in described]
        first = min(e.message_start_time for e in self._entries)
        last = max(e.message_end_time for e in self._entries)
        count = sum(self._counts.values())
        attached = self._attachment
        entry = AttachmentPlace(
            offset=self._attached_at,
            length=self._attached,
            log_time=0,
            create_time=0,
            data_size=len(attached.data),
            name=attached.name,
            media_type=attached.media_type,
        )
        numbers = {"attachment_count": 1, "metadata_count": 0, "chunk_count": len(self._entries)}
        numbers |= {"schema_count": kinds.count("Schema"), "channel_count": kinds.count("Channel"), "message_count": count}
        told = Statistics(channel_message_counts=self._counts, message_start_time=first, message_end_time=last, **numbers)
        for record in (*described, *self._entries, entry, told):
            self._write(record)
        self._write(Footer(begin, 0, 0))
        self._out.write(MAGIC)

    def _write(self, record) -> int:
        """Returns its bytes."""
        builder = RecordBuilder()
        record.write(builder)
        return self._out.write(builder.end())

"""Where everything lies in an MCAP file: from its summary, or, when it was cut off, by walking through its records."""

import contextlib
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from io import BytesIO
from typing import BinaryIO

import lz4.frame  # pyright: ignore[reportMissingTypeStubs]
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, AttachmentIndex, Channel, Chunk, Message, Metadata, MetadataIndex, Statistics

MAGIC = b"\x89MCAP0\r\n"
_RECORD = struct.Struct("<BQ")
_TIMES = struct.Struct("<QQ")
_CHUNK_INDEX = struct.Struct("<QQQQI")
"""How a chunk's entry in the summary begins: first and last time, where the chunk stands, its length, and how many bytes follow of
where the indices of its messages stand, `_PLACE_BYTES` for each channel, its id first."""
_PLACE_BYTES = 10
_CHUNK_INDEX_ENDS = 28
"""Bytes of such an entry after those, at least."""
_MESSAGE = struct.Struct("<HIQQ")
"""What stands before a message's data: channel, sequence, log time, publish time."""
_FOOTER = struct.Struct("<BQQQI")
"""The last record: opcode, length, where the summary begins, where the offsets in it do, a checksum of both."""

# A file of somebody else takes no more memory than this, whatever it says of itself.
MOST_UNPACKED_BYTES = 64 << 20
"""Of a chunk: what VISTEL and others write has some megabytes."""
MOST_MESSAGES = 200_000
"""Of a chunk; those of VISTEL have some hundreds."""
MOST_CHUNK_BYTES = MOST_UNPACKED_BYTES + (1 << 20)
"""Of a chunk as it stands in the file."""
MOST_SUMMARY_BYTES = 256 << 20
"""Of a summary: an hour has some megabytes. With more, the file is read from the front."""
MOST_ATTACHED_BYTES = 4 << 20
"""Of all attachments and metadata that are kept: a conference file has some kilobytes."""
MOST_CHANNEL_BYTES = 16 << 10
"""Of a channel's record; other programs keep a kilobyte there."""
MOST_KEY_LETTERS = 1024
"""Of a channel's name."""


class BrokenLogError(ValueError):
    """Bytes that are not what an MCAP file has there."""


BROKEN = (McapError, ValueError, EOFError, RuntimeError, struct.error, LookupError, OverflowError, MemoryError, TypeError, OSError)
"""What the reading of changed bytes may raise, in mcap and in the decompressors, and from places that are not in a file."""


@dataclass(frozen=True)
class ChunkPlace:
    """A chunk of messages: where its record begins in the file [byte], the log times it spans, and the ids of the channels that it
    has messages of; None: not known."""

    offset: int
    begin_ns: int
    end_ns: int
    channels: frozenset[int] | None = None


@dataclass
class LogIndex:
    """Everything but the messages. walked: byte up to which a file without a summary has been read; None: it has one."""

    chunks: list[ChunkPlace] = field(default_factory=list[ChunkPlace])
    channels: dict[int, Channel] = field(default_factory=dict[int, Channel])
    attachments: dict[str, bytes] = field(default_factory=dict[str, bytes])
    metadata: dict[str, dict[str, str]] = field(default_factory=dict[str, dict[str, str]])
    damage: list[str] = field(default_factory=list[str])
    walked: int | None = None
    _attached: int = 0

    def attach(self, file: BinaryIO, opcode: int, begin: int, length: int) -> None:
        """Keep the attachment or the metadata whose content begins at byte `begin`; what cannot be one, or is too long, is left."""
        self._attached += length
        if self._attached > MOST_ATTACHED_BYTES:
            return
        file.seek(begin)
        stream = ReadDataStream(BytesIO(file.read(length)))
        with contextlib.suppress(*BROKEN):
            if opcode == Opcode.ATTACHMENT:
                attachment = Attachment.read(stream)
                self.attachments[attachment.name] = attachment.data
            elif opcode == Opcode.METADATA:
                metadata = Metadata.read(stream)
                self.metadata[metadata.name] = dict(metadata.metadata)


def read_index(file: BinaryIO, size: int) -> LogIndex:
    """The index of a file of `size` bytes. Raises BrokenLogError when it is no MCAP file."""
    if file.read(len(MAGIC)) != MAGIC:
        raise BrokenLogError("it does not begin as one" if size else "it is empty")
    file.seek(max(0, size - len(MAGIC)))
    if file.read() == MAGIC and size > len(MAGIC):
        try:
            return _from_summary(file, size)
        except BROKEN:
            return _by_walking(file, size, "its index is broken; it was read from the front")
    return _by_walking(file, size, None)


def open_chunk(file: BinaryIO, place: ChunkPlace, wants: Callable[[int], bool] = lambda _: True) -> list[Channel | Message]:
    """The channels, and the messages of the channels that `wants` names by their ids, in the chunk at `place`. A channel stands
    before its first message. Raises BrokenLogError."""
    try:
        file.seek(place.offset)
        _, length = _RECORD.unpack(file.read(_RECORD.size))
        if length > MOST_CHUNK_BYTES:
            raise BrokenLogError(f"it claims to have {length} bytes")
        chunk = _unpacked(Chunk.read(ReadDataStream(BytesIO(file.read(length)))))
        if chunk.uncompressed_crc and zlib.crc32(chunk.data) != chunk.uncompressed_crc:
            raise BrokenLogError("crc validation failed")
        return list(_records(chunk.data, wants))
    except BROKEN as e:
        raise BrokenLogError(str(e) or type(e).__name__) from e


def _records(data: bytes, wants: Callable[[int], bool]) -> Iterator[Channel | Message]:
    """As mcap's `breakup_chunk`, but messages that are not wanted are stepped over, which is most of the work."""
    at, size, opcode, record, left = 0, len(data), int(Opcode.MESSAGE), _RECORD.size, MOST_MESSAGES
    while at < size:
        kind, length = _RECORD.unpack_from(data, at)
        at += record
        if at + length > size:
            raise BrokenLogError("a record in it is longer than it is")
        if kind == opcode:
            channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(data, at)
            if wants(channel):
                left -= 1
                if left < 0:
                    raise BrokenLogError(f"it has more than {MOST_MESSAGES} messages")
                yield Message(channel, log_time, data[at + _MESSAGE.size : at + length], publish_time, sequence)
        elif kind == Opcode.CHANNEL:
            yield _channel(data[at : at + length])
        at += length


def _channel(record: bytes) -> Channel:
    """A channel, without what others say of it. Raises BrokenLogError."""
    if len(record) > MOST_CHANNEL_BYTES:
        raise BrokenLogError(f"a channel takes {len(record)} bytes")
    channel = Channel.read(ReadDataStream(BytesIO(record)))
    if len(channel.topic) > MOST_KEY_LETTERS:
        raise BrokenLogError(f"a channel's name has {len(channel.topic)} letters")
    return replace(channel, metadata={})


def _unpacked(chunk: Chunk) -> Chunk:
    """The chunk without compression. However small it is, it never becomes larger than it says, nor than MOST_UNPACKED_BYTES."""
    size = chunk.uncompressed_size
    if size > MOST_UNPACKED_BYTES:
        raise BrokenLogError(f"it claims to have {size} bytes once unpacked")
    if chunk.compression == "lz4":
        data = bytes(lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, size + 1))  # pyright: ignore
    elif chunk.compression == "zstd":
        data = zstandard.ZstdDecompressor().stream_reader(chunk.data).read(size + 1)
    else:
        data = chunk.data
    if len(data) != size:
        raise BrokenLogError(f"it is not of the {size} bytes that it claims")
    return replace(chunk, compression="", data=data)


def _from_summary(file: BinaryIO, size: int) -> LogIndex:
    footer = size - len(MAGIC) - _FOOTER.size
    file.seek(max(0, footer))
    opcode, _, begin, _, _ = _FOOTER.unpack(file.read(_FOOTER.size))
    if opcode != Opcode.FOOTER or not 0 < begin <= footer or footer - begin > MOST_SUMMARY_BYTES:
        raise BrokenLogError("no summary")
    file.seek(begin)
    summary = file.read(footer - begin)
    index = LogIndex()
    alike: dict[bytes, frozenset[int]] = {}  # most chunks have messages of the same channels
    messages = at = 0
    while at < len(summary):
        opcode, length = _RECORD.unpack_from(summary, at)
        at += _RECORD.size
        if at + length > len(summary):
            raise BrokenLogError("a record of its summary is longer than that")
        record = summary[at : at + length]
        at += length
        if opcode == Opcode.CHANNEL:
            channel = _channel(record)
            index.channels[channel.id] = channel
        elif opcode == Opcode.CHUNK_INDEX:
            index.chunks.append(_chunk_place(record, alike))
        elif opcode == Opcode.STATISTICS:
            messages = Statistics.read(ReadDataStream(BytesIO(record))).message_count
        elif opcode in (Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX):
            kind = AttachmentIndex if opcode == Opcode.ATTACHMENT_INDEX else MetadataIndex
            _attach_at(file, kind.read(ReadDataStream(BytesIO(record))).offset, index)
    if messages and not index.chunks:
        raise BrokenLogError("no index of its chunks")
    return index


def _chunk_place(record: bytes, alike: dict[bytes, frozenset[int]]) -> ChunkPlace:
    """The place that an entry of the summary tells, as mcap's `ChunkIndex.read` does, which takes ten times as long: a gigabyte has
    forty thousand chunks. alike: sets of channels by the bytes of their ids. Raises BrokenLogError, struct.error."""
    begin_ns, end_ns, offset, _, size = _CHUNK_INDEX.unpack_from(record)
    at = _CHUNK_INDEX.size
    if size % _PLACE_BYTES or at + size + _CHUNK_INDEX_ENDS > len(record):
        raise BrokenLogError("an entry of a chunk is cut off")
    ids = record[at : at + size : _PLACE_BYTES] + record[at + 1 : at + size : _PLACE_BYTES]
    known = alike.get(ids)
    if known is None:
        count = size // _PLACE_BYTES
        known = alike[ids] = frozenset(low | high << 8 for low, high in zip(ids[:count], ids[count:], strict=True))
    return ChunkPlace(offset, begin_ns, end_ns, known or None)


def _attach_at(file: BinaryIO, offset: int, index: LogIndex) -> None:
    file.seek(offset)
    opcode, length = _RECORD.unpack(file.read(_RECORD.size))
    index.attach(file, opcode, offset + _RECORD.size, length)


def _by_walking(file: BinaryIO, size: int, remark: str | None) -> LogIndex:
    """Hop from record to record as long as they are whole."""
    index = LogIndex(damage=[remark] if remark else [], walked=len(MAGIC))
    ended = walk_on(file, size, index)
    if not ended:
        index.damage.append(_cut_off(index, index.walked or 0, size))
    return index


def walk_on(file: BinaryIO, size: int, index: LogIndex) -> bool:
    """Read on where the walk through a file ended that has grown to `size` bytes since; True: its data have an end."""
    offset = index.walked or len(MAGIC)
    ended = False
    walk = _Walk(file, index)
    while not ended and offset + _RECORD.size <= size:
        file.seek(offset)
        opcode, length = _RECORD.unpack(file.read(_RECORD.size))
        begin = offset + _RECORD.size
        if begin + length > size or not 1 <= opcode <= 15:
            break
        walk.take(opcode, offset, begin, length)
        ended = opcode == Opcode.DATA_END
        offset = begin + length
    walk.chunk_ends(last=True)
    index.walked = offset
    return ended


class _Walk:
    """What is found on the way through a file. A chunk is opened only where it may have a channel that is not known."""

    def __init__(self, file: BinaryIO, index: LogIndex) -> None:
        self._file, self._index = file, index
        self._place: ChunkPlace | None = None
        self._has: set[int] = set()
        self._alike: dict[frozenset[int], frozenset[int]] = {}

    def take(self, opcode: int, offset: int, begin: int, length: int) -> None:
        """A whole record. offset: where it stands, begin: where its content does, which has `length` bytes."""
        if opcode == Opcode.MESSAGE_INDEX:
            self._has.add(int.from_bytes(self._file.read(2), "little"))
            return
        self.chunk_ends()
        self._file.seek(begin)
        if opcode == Opcode.CHUNK:
            self._place = ChunkPlace(offset, *_TIMES.unpack(self._file.read(_TIMES.size)))
        elif opcode in (Opcode.ATTACHMENT, Opcode.METADATA):
            self._index.attach(self._file, opcode, begin, length)

    def chunk_ends(self, *, last: bool = False) -> None:
        """All that follows a chunk about its channels has been read; last: perhaps not all of it is there."""
        place, has = self._place, frozenset(self._has)
        self._place, self._has = None, set()
        if place is None:
            return
        if last:
            has = frozenset[int]()
        if not has or not has <= self._index.channels.keys():
            with contextlib.suppress(BrokenLogError):  # reading the messages will tell
                # Channels stand only in the chunk that has their first message.
                here = open_chunk(self._file, place, lambda _: False)
                self._index.channels.update((r.id, r) for r in here if isinstance(r, Channel))
        self._index.chunks.append(replace(place, channels=self._alike.setdefault(has, has) if has else None))


def _cut_off(index: LogIndex, whole: int, size: int) -> str:
    if index.chunks:
        first, last = min(c.begin_ns for c in index.chunks), max(c.end_ns for c in index.chunks)
        have = f"the last whole message is at {(last - first) * 1e-9:.3f} s"
    else:
        have = "no message in it is whole"
    lost = f"{size - whole} of {size} bytes at the end are not readable, and what should follow is missing"
    return f"cut off: {lost}; {have}"

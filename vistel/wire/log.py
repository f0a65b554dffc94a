"""Logs of a conference: MCAP files with the protobuf schemas inside, so that Foxglove and Rerun open them too.

One channel per key. `log_time` is when a message arrived at the recorder, `publish_time` its `header.t_ns`, both conference time.
The conference file is an attachment; the clock offsets of the nodes, as last seen, are metadata. Chunks are closed at 256 KB or
after a second, so a recorder that dies loses at most the last second.
"""

import contextlib
import heapq
import os
import tomllib
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self, cast

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError, Message
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, ChunkIndex
from mcap.records import Message as McapMessage
from mcap.writer import CompressionType, Writer

from vistel.v1.envelope_pb2 import Headed, Header
from vistel.wire.limits import most_bytes, objection_to_texts, short_bytes
from vistel.wire.log_index import BrokenLogError, ChunkPlace, LogIndex, open_chunk, read_index, walk_on
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION, TOPICS, Publisher, Topic

CHUNK_BYTES = 256 * 1024
FLUSH_NS = 1_000_000_000
CONFERENCE_FILE = "conference.toml"
OFFSETS = "vistel.clock_offsets"
MOST_TOLD = 100
"""Lines about what is damaged; more tell nothing new."""
MOST_LETTERS = 200
"""Of what such a line says of a file's own words."""
MOST_LENGTH_NS = 31 * 24 * 3600 * 1_000_000_000
"""Of a log: no meeting takes a month, and who plays one to its end should see it [ns]."""
MOST_OPEN_BYTES = 256 << 20
"""Of messages of chunks that overlap in time, which are all in memory until their order is known."""
MESSAGE_BYTES = 300
"""What a message takes there beside its payload."""


class LogError(ValueError):
    """A log that cannot be used at all; the text is one line that says why."""


@dataclass(frozen=True)
class LogRecord:
    """One message of a log. log_ns: conference time of its arrival; size: bytes of its payload."""

    topic: Topic
    key: str
    names: dict[str, str]
    message: Any
    log_ns: int
    size: int


class LogWriter:
    """Writes a log; use it in a `with`. Not for two threads at once."""

    def __init__(self, path: Path, conference: str | None = None) -> None:
        """conference: the text of the conference file. Raises OSError when `path` cannot be written."""
        self.path = path
        self._file = path.open("wb")
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.LZ4)
        self.messages = 0
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._offsets: dict[str, str] = {}
        self._flushed_ns: int | None = None
        try:
            self._writer.start(profile="vistel", library="vistel")
            if conference is not None:
                self._writer.add_attachment(0, 0, CONFERENCE_FILE, "application/toml", conference.encode("utf-8"))
            self._file.flush()
        except OSError:
            self.abandon()
            raise

    def write(self, topic: Topic, key: str, message: Message, log_ns: int) -> int:
        """Append a message of `topic` that arrived on `key` at `log_ns`. Returns the bytes of its payload."""
        if topic.name == "clock_offset":
            self._note_offset(message)
        return self._add(topic, key, message.SerializeToString(), getattr(message, "header", None), log_ns)

    def write_packed(self, topic: Topic, key: str, data: bytes, log_ns: int) -> int:
        """As `write`, of a message's bytes as they were sent."""
        if topic.name == "clock_offset":
            self._note_offset(topic.message.FromString(data))
        return self._add(topic, key, data, Headed.FromString(data).header, log_ns)

    def _add(self, topic: Topic, key: str, data: bytes, header: Header | None, log_ns: int) -> int:
        self._writer.add_message(
            self._channel(topic, key),
            log_time=log_ns,
            data=data,
            publish_time=header.t_ns if header is not None else log_ns,
            sequence=header.seq & 0xFFFFFFFF if header is not None else 0,
        )
        self.messages += 1
        if self._flushed_ns is None:
            self._flushed_ns = log_ns
        elif not 0 <= log_ns - self._flushed_ns < FLUSH_NS:
            self.flush()
            self._flushed_ns = log_ns
        return len(data)

    def flush(self) -> None:
        """Close the open chunk and hand it to the operating system."""
        self._writer._Writer__finalize_chunk()  # pyright: ignore  (mcap has no public way)
        self._pack_index()
        self._file.flush()
        self._flushed_ns = None

    def _pack_index(self) -> None:
        """A chunk a second, each with a place for every channel, is 16 MB an hour until the index is written at the end."""
        index = cast(list[Any], self._writer._Writer__chunk_indices)  # pyright: ignore  (the same)
        for number in range(len(index) - 1, -1, -1):
            if isinstance(index[number], _PackedIndex):
                return
            index[number] = _PackedIndex(index[number])

    def close(self) -> None:
        """Write the index. A log that was not closed can be read all the same."""
        if not self._file.closed:
            if self._offsets:
                self._writer.add_metadata(OFFSETS, self._offsets)
            self._writer.finish()
            self._file.close()

    def abandon(self) -> None:
        """Let go of a file that the disk takes no more of. What is whole in it stays; a file without a message is removed."""
        with contextlib.suppress(OSError):
            self._file.raw.close()
            if not self.messages:
                self.path.unlink()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def _channel(self, topic: Topic, key: str) -> int:
        found = self._channels.get(key)
        if found is None:
            found = self._channels[key] = self._writer.register_channel(key, "protobuf", self._schema(topic), {"topic": topic.name})
        return found

    def _schema(self, topic: Topic) -> int:
        descriptor = topic.message.DESCRIPTOR
        found = self._schemas.get(descriptor.full_name)
        if found is None:
            found = self._schemas[descriptor.full_name] = self._writer.register_schema(
                descriptor.full_name, "protobuf", descriptor_set(descriptor)
            )
        return found

    def _note_offset(self, message: Any) -> None:
        self._offsets[message.node] = f"{message.offset_ns} ns +- {message.uncertainty_ns} ns at {message.header.t_ns}"


class _PackedIndex:
    """A chunk's entry in the index, as the bytes that will be written, compressed."""

    def __init__(self, entry: ChunkIndex) -> None:
        record = RecordBuilder()
        entry.write(record)
        self._packed = zlib.compress(record.end())

    def write(self, stream: RecordBuilder) -> None:
        """As `ChunkIndex.write`."""
        stream.write(zlib.decompress(self._packed))


class LogReader:
    """Reads a log, whole or damaged: what is whole comes, `damage` tells what is missing.

    begin_ns, end_ns: conference time of the first and last message. conference: the conference file as data,
    or None. damage: one line per fault; grows while reading, when a chunk turns out to be broken.
    """

    def __init__(self, path: Path) -> None:
        """Raises LogError when `path` is absent or no log."""
        self.path = path
        try:
            with path.open("rb") as file:
                index = read_index(file, os.fstat(file.fileno()).st_size)
        except OSError as e:
            raise LogError(f"{path}: cannot be read: {e.strerror}") from e
        except BrokenLogError as e:
            raise LogError(f"{path}: is not an MCAP log: {e}") from e
        self._index: LogIndex = index
        self._bounds: dict[str, tuple[int, int]] = {}
        self._read_ns = 0
        self.damage: list[str] = list(index.damage)
        self.begin_ns: int = min((c.begin_ns for c in index.chunks), default=0)
        self.end_ns: int = self._believed(max((c.end_ns for c in index.chunks), default=0))
        text = index.attachments.get(CONFERENCE_FILE)
        self.conference_toml: str | None = text.decode("utf-8", "replace") if text is not None else None
        self.conference: dict[str, Any] | None = self._parse(self.conference_toml)
        self.clock_offsets: dict[str, str] = index.metadata.get(OFFSETS, {})

    @property
    def length_s(self) -> float:
        """From the first message to the last, seconds."""
        return (self.end_ns - self.begin_ns) * 1e-9

    @property
    def grows(self) -> bool:
        """Whether the file has no index yet: it is being written, or was cut off."""
        return self._index.walked is not None

    def grow(self) -> bool:
        """See what has been appended to a log without an index since; True: there is more."""
        index, before = self._index, len(self._index.chunks)
        if index.walked is None:
            return False
        try:
            with self.path.open("rb") as file:
                size = os.fstat(file.fileno()).st_size
                if size > index.walked:
                    walk_on(file, size, index)
        except OSError as e:
            self._damaged(f"cannot be read any more: {e.strerror}")
        new = index.chunks[before:]
        self.begin_ns = min((c.begin_ns for c in new), default=self.begin_ns) if before == 0 else self.begin_ns
        self.end_ns = self._believed(max([self.end_ns, *(c.end_ns for c in new)]))
        return bool(new)

    @property
    def keys(self) -> dict[str, tuple[Topic, dict[str, str]]]:
        """Every key that is known to have messages: its topic and names."""
        found = {channel.topic: self._topic_of(channel.topic) for channel in self._index.channels.values()}
        return {key: (topic[0], topic[2]) for key, topic in found.items() if topic is not None}

    def packed(
        self, topics: tuple[str, ...], begin_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[tuple[Topic, str, bytes, int]]:
        """As `records`, as they stand in the log, whatever their version: topic, key, payload, log time [ns]."""
        for (topic, _, _), channel, message in self._found(topics, begin_ns, end_ns, {}):
            yield topic, channel.topic, message.data, message.log_time

    def records(
        self, topics: tuple[str, ...] | None = None, begin_ns: int | None = None, end_ns: int | None = None, **names: str
    ) -> Iterator[LogRecord]:
        """Messages in the order they arrived, from `begin_ns` (included) to `end_ns` (excluded).

        topics: names of the topics table; None gives all. names: what keys must say, such as participant="ben". Starts at once from
        any time, by the chunks' index; what is not asked for is not decoded.
        """
        for found, channel, message in self._found(topics, begin_ns, end_ns, names):
            parsed = self._decode(found[0], channel.topic, message)
            if parsed is not None:
                yield LogRecord(found[0], channel.topic, found[2], parsed, message.log_time, len(message.data))

    def _found(
        self, topics: tuple[str, ...] | None, begin_ns: int | None, end_ns: int | None, names: dict[str, str]
    ) -> Iterator[tuple[tuple[Topic, str, dict[str, str]], Channel, McapMessage]]:
        wanted = {BY_NAME[name].name for name in topics} if topics is not None else None
        known: dict[int, tuple[Topic, str, dict[str, str]] | None] = {}
        begin = self.begin_ns if begin_ns is None else begin_ns
        end = self.end_ns + 1 if end_ns is None else end_ns

        def wants(channel: Channel) -> bool:
            if channel.id not in known:
                found = self._topic_of(channel.topic)
                asked = found and (wanted is None or found[0].name in wanted) and names.items() <= found[2].items()
                known[channel.id] = found if asked else None
            return known[channel.id] is not None

        for channel, message in self._messages(begin, end, wants):
            found = known[channel.id]
            assert found is not None
            yield found, channel, message

    @property
    def share_read(self) -> float:
        """How far into the log reading has come, 0 to 1."""
        return max(0, self._read_ns - self.begin_ns) / max(1, self.end_ns - self.begin_ns)

    def _messages(self, begin_ns: int, end_ns: int, wants: Callable[[Channel], bool]) -> Iterator[tuple[Channel, McapMessage]]:
        """Merge the chunks by time; they overlap only a little, so few are open at once."""
        chunks = [c for c in self._index.chunks if c.end_ns >= begin_ns and c.begin_ns < end_ns]
        channels = dict(self._index.channels)
        held = 0
        heap: list[tuple[int, int, int, McapMessage]] = []

        def wanted(channel: int) -> bool:
            return channel not in channels or wants(channels[channel])

        chunks = [c for c in chunks if c.channels is None or any(wanted(channel) for channel in c.channels)]
        chunks.sort(key=lambda c: (c.begin_ns, c.offset), reverse=True)

        with self.path.open("rb") as file:
            while heap or chunks:
                while chunks and (not heap or chunks[-1].begin_ns <= heap[0][0]):
                    place = chunks.pop()
                    self._read_ns = place.begin_ns
                    if held > MOST_OPEN_BYTES:
                        self._lack(place, "too much of the log claims to be of the same time")
                        continue
                    for n, record in enumerate(self._open_chunk(file, place, wanted)):
                        if isinstance(record, Channel):
                            channels[record.id] = record
                        elif begin_ns <= record.log_time < end_ns:
                            held += MESSAGE_BYTES + len(record.data)
                            heapq.heappush(heap, (record.log_time, place.offset, n, record))
                while heap and not (chunks and chunks[-1].begin_ns <= heap[0][0]):
                    message = heapq.heappop(heap)[3]
                    held -= MESSAGE_BYTES + len(message.data)
                    if message.channel_id in channels and wanted(message.channel_id):
                        yield channels[message.channel_id], message

    def _open_chunk(self, file: BinaryIO, place: ChunkPlace, wants: Callable[[int], bool]) -> list[Channel | McapMessage]:
        try:
            return open_chunk(file, place, wants)
        except BrokenLogError as e:
            self._lack(place, shown(str(e)))
            return []

    def _lack(self, place: ChunkPlace, why: str) -> None:
        at, until = ((t - self.begin_ns) * 1e-9 for t in (place.begin_ns, place.end_ns))
        self._damaged(f"a chunk at byte {place.offset} is broken ({why}): messages from {at:.3f} s to {until:.3f} s are missing")

    def _topic_of(self, key: str) -> tuple[Topic, str, dict[str, str]] | None:
        for topic in TOPICS:
            names = topic.match(key)
            if names is not None:
                return topic, key, names
        self._damaged(f"channel {shown(key)} is not in this version's table of topics; it is left out")
        return None

    def _decode(self, topic: Topic, key: str, record: McapMessage) -> Any | None:
        message = topic.message()
        most, short = self._bounds.get(topic.name) or self._bounds_of(topic)
        size = len(record.data)
        if size > most:
            self._damaged(f"channel {key} holds messages of more than {most} bytes; they are left out")
            return None
        try:
            message.ParseFromString(record.data)
        except DecodeError:
            self._damaged(f"channel {key} holds messages that are no {topic.message.DESCRIPTOR.name}; they are left out")
            return None
        if size > short and (reason := objection_to_texts(message)):
            self._damaged(f"channel {key} holds messages whose {reason}; they are left out")
            return None
        version = getattr(message, "header").version  # noqa: B009
        if version != MESSAGE_VERSION:
            self._damaged(f"channel {key} has messages of version {version}, this is {MESSAGE_VERSION}; they are left out")
            return None
        return message

    def _bounds_of(self, topic: Topic) -> tuple[int, int]:
        """How long a message may be, and from what length on its texts are looked at: as by a subscription, those of sites."""
        most = most_bytes(topic)
        found = most, short_bytes(topic.message.DESCRIPTOR) if topic.publisher is Publisher.SITE else most
        self._bounds[topic.name] = found
        return found

    def _parse(self, text: str | None) -> dict[str, Any] | None:
        try:
            return tomllib.loads(text) if text is not None else None
        except (ValueError, RecursionError) as e:
            self._damaged(f"the conference file inside is not valid TOML: {shown(str(e))}")
            return None

    def _believed(self, end_ns: int) -> int:
        if end_ns - self.begin_ns <= MOST_LENGTH_NS:
            return end_ns
        days = (end_ns - self.begin_ns) / (24 * 3600e9)
        self._damaged(f"its times span {days:.0f} days; what is later than 31 days after its first message is left out")
        return self.begin_ns + MOST_LENGTH_NS

    def _damaged(self, line: str) -> None:
        if len(self.damage) < MOST_TOLD and line not in self.damage:
            self.damage.append(line if len(self.damage) < MOST_TOLD - 1 else "and more, which is not told")


def shown(text: str) -> str:
    """What a file says, cut, and without what would move a terminal's cursor."""
    plain = "".join(c if c.isprintable() else "�" for c in text[:MOST_LETTERS])
    return plain if len(text) <= MOST_LETTERS else f"{plain}…"


def descriptor_set(descriptor: Any) -> bytes:
    """What a reader needs to know of a message type: its file and those that this one imports, as the schema of a channel."""
    files = FileDescriptorSet()
    _add_with_imports(files, descriptor.file, set())
    return files.SerializeToString()


def _add_with_imports(files: FileDescriptorSet, file: Any, seen: set[str]) -> None:
    if file.name in seen:
        return
    seen.add(file.name)
    for imported in file.dependencies:
        _add_with_imports(files, imported, seen)
    file.CopyToProto(files.file.add())

"""A log of somebody else, which an honest person opens. What it needs: to send a file."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import tomllib
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path

import aiohttp
import lz4.frame
import pytest
import tomli_w
import zstandard
from aiohttp import web
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    Schema,
    Statistics,
)
from typer.testing import CliRunner, Result

from vistel.conference.files import DEMO_FILE, load
from vistel.conference.model import Conference
from vistel.v1.command_pb2 import Command
from vistel.v1.motion_pb2 import Motion, Participant
from vistel.wire.clock import SystemClock
from vistel.wire.log import CONFERENCE_FILE, MOST_LETTERS, MOST_TOLD, LogReader
from vistel.wire.log_index import MAGIC, MOST_MESSAGES
from vistel_cli.log.replay import _conference as of_replay
from vistel_cli.main import app
from vistel_services.console.replays import Replays

START_NS = 1_700_000_000_000_000_000
MOTION = "vistel/demo/site/tokyo/participant/ann/motion"
NO_STATISTICS = Statistics(
    attachment_count=1, channel_count=1, channel_message_counts={}, chunk_count=1, message_count=1, message_end_time=0,
    message_start_time=0, metadata_count=0, schema_count=0,
)  # fmt: skip
MOST_MORE_MB = 700
"""What the reading of a hostile log may take at its height, with the 256 MB of messages that may be open at once."""
READ = """
import json, resource, sys
from vistel.wire.log import LogReader
from pathlib import Path
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))  # this machine stays whole
status = lambda what: int(next(l for l in open("/proc/self/status") if l.startswith(what)).split()[1]) // 1024
before = status("VmHWM"), status("VmPeak")
reader = LogReader(Path(sys.argv[1]))
reader.keys
read = sum(1 for _ in reader.records())
more = max(status("VmHWM") - before[0], status("VmPeak") - before[1])
print(json.dumps({"read": read, "damage": reader.damage, "more_mb": more}))
"""


def record(*records: object) -> bytes:
    builder = RecordBuilder()
    for r in records:
        r.write(builder)  # type: ignore[attr-defined]
    return builder.end()


def written(path: Path, data: Iterable[bytes], summary: Callable[[int], bytes] | None = None, begins: int | None = None) -> Path:
    """A file of these records. summary: its summary, by where it begins; begins: where the footer says that it does."""
    body = MAGIC + record(Header("", "")) + b"".join(data) + record(DataEnd(0))
    told = summary(len(body)) if summary else b""
    footer = record(Footer(begins if begins is not None else len(body) if told else 0, 0, 0))
    path.write_bytes(body + told + footer + MAGIC)
    return path


def channel(number: int, key: str) -> Channel:
    return Channel(number, key, "protobuf", {}, 0)


def message(number: int, data: bytes, t_ns: int = START_NS) -> Message:
    return Message(number, t_ns, data, t_ns, 0)


def chunk(
    data: bytes, begin_ns: int = START_NS, end_ns: int = START_NS, compression: str = "zstd", says: int | None = None
) -> Chunk:
    packed = {"zstd": zstandard.compress, "lz4": lz4.frame.compress, "": bytes}[compression](data)
    return Chunk(compression, packed, end_ns, START_NS, 0, len(data) if says is None else says)


def said(message: object) -> bytes:
    message.header.version, message.header.t_ns = 1, START_NS  # type: ignore[attr-defined]
    return message.SerializeToString()  # type: ignore[attr-defined]


def conference(text: bytes) -> Attachment:
    return Attachment(0, 0, CONFERENCE_FILE, "", text)


def motion() -> bytes:
    return said(Motion(body=[1]))


def one_message() -> Chunk:
    return chunk(record(channel(1, MOTION), message(1, motion())))


def expanding_chunk(path: Path) -> Path:
    """A gigabyte of zeros in some kilobytes, and said so."""
    return written(path, [record(chunk(bytes(1 << 30)))])


def summary_that_is_a_chunk(path: Path) -> Path:
    """The footer sends the reader of the summary into such a chunk."""
    bomb = record(chunk(bytes(1 << 30), says=1 << 30))
    return written(path, [bomb], lambda at: record(NO_STATISTICS), len(MAGIC + record(Header("", ""))))


def longer_than_the_file(path: Path) -> Path:
    """Records that say 2^62 bytes, as a chunk and as an attachment of the index."""
    place = len(MAGIC + record(Header("", "")))
    huge = bytes([Opcode.CHUNK]) + (1 << 62).to_bytes(8, "little") + bytes(100)
    index = [
        ChunkIndex(1 << 62, place, "", 1 << 62, START_NS, 0, {}, START_NS, 1 << 62),
        ChunkIndex(1 << 62, 1 << 62, "", 1 << 62, START_NS, 0, {}, START_NS, 1 << 62),
        AttachmentIndex(place, 1 << 62, 0, 0, 1 << 62, CONFERENCE_FILE, ""),
    ]
    return written(path, [huge], lambda at: record(*index, NO_STATISTICS))


def attachment_of_gigabytes(path: Path) -> Path:
    """A file with a hole: it takes no space, and says three gigabytes of a conference file."""
    head = MAGIC + record(Header("", ""))
    whole = record(Attachment(0, 0, CONFERENCE_FILE, "", b""))
    with path.open("wb") as file:
        file.write(head + bytes([whole[0]]) + (3 << 30).to_bytes(8, "little") + whole[9:-12] + (3 << 30).to_bytes(8, "little"))
        file.truncate(len(head) + 9 + (3 << 30))
        file.seek(0, 2)
        at = file.tell()
        place = AttachmentIndex(len(head), 3 << 30, 0, 0, 3 << 30, CONFERENCE_FILE, "")
        file.write(record(DataEnd(0), place, Footer(at + 13, 0, 0)) + MAGIC)
    return path


def as_many_channels_as_there_are_numbers(path: Path) -> Path:
    """65,536, each with a name of a thousand letters, and schemas of megabytes; with or without a summary."""
    schemas = [record(Schema(1 + n, bytes(4 << 20), "x" * 100_000, "protobuf")) for n in range(8)]
    channels = [record(channel(n, f"{n:05d}\x1b[2J" + "x" * 1000)) for n in range(65_536)]
    empty = record(chunk(b"".join(channels), says=None))
    return written(path, [*schemas, empty], lambda at: b"".join(channels))


def channels_of_megabytes(path: Path) -> Path:
    """A name of 30 MB, which takes some bytes in each of many chunks, of a file that is cut off."""
    chunks = [record(chunk(record(channel(n, "x" * (30 << 20))))) for n in range(25)]
    path.write_bytes(MAGIC + record(Header("", "")) + b"".join(chunks))
    return path


def all_of_one_time(path: Path) -> Path:
    """Hundreds of chunks, each small in the file and large in memory, which all claim to span the whole time."""
    first = record(channel(1, MOTION))
    messages = record(*(message(1, motion(), START_NS + n) for n in range(1000)))
    data = first + messages * ((MOST_MESSAGES - 1) // 1000)
    one = record(chunk(data, end_ns=START_NS + 10**12))
    return written(path, [one] * 250)


def more_messages_than_bytes(path: Path) -> Path:
    """Empty messages: 31 bytes in the chunk each, three hundred in memory."""
    data = record(channel(1, MOTION)) + record(message(1, b"")) * (60 * 1024 * 1024 // 31)
    return written(path, [record(chunk(data, compression="lz4"))])


def a_message_of_many_parts(path: Path) -> Path:
    """60 MB of two-byte parts of a command, each of which would be an object."""
    part = Command(move={"which": {}}).SerializeToString()
    key = "vistel/demo/site/tokyo/participant/ann/command"
    data = record(channel(1, key), message(1, part * ((60 << 20) // len(part))))
    return written(path, [record(chunk(data))])


def a_long_text(path: Path) -> Path:
    key = "vistel/demo/site/tokyo/participant/ann/about"
    data = record(channel(1, key), message(1, said(Participant(avatar="n" * 20_000))))
    return written(path, [record(chunk(data))])


def three_centuries(path: Path) -> Path:
    data = record(channel(1, MOTION), message(1, motion()), message(1, motion(), (1 << 63) + START_NS))
    return written(path, [record(chunk(data, end_ns=(1 << 63) + START_NS))])


def nested_conference(path: Path) -> Path:
    return written(path, [record(conference(b"x = " + b"[" * 100_000), chunk(b""))])


def wrong_conference(path: Path) -> Path:
    text = b'name = "\\u001b[2J"\nsites = 3\n'
    return written(path, [record(conference(text), one_message())])


def honest(path: Path) -> Path:
    return written(path, [record(conference(DEMO_FILE.read_bytes()), one_message())])


HOSTILE: list[tuple[Callable[[Path], Path], int, str]] = [
    (expanding_chunk, 0, "claims to have 1073741824 bytes once unpacked"),
    (summary_that_is_a_chunk, 0, "its index is broken"),
    (longer_than_the_file, 0, ""),
    (attachment_of_gigabytes, 0, ""),
    (as_many_channels_as_there_are_numbers, 0, "not in this version's table of topics"),
    (channels_of_megabytes, 0, ""),
    (all_of_one_time, 1, "claims to be of the same time"),
    (more_messages_than_bytes, 0, f"more than {MOST_MESSAGES} messages"),
    (a_message_of_many_parts, 0, "holds messages of more than"),
    (a_long_text, 0, "avatar has 20000 letters"),
    (three_centuries, 1, "its times span"),
    (nested_conference, 0, "is not valid TOML"),
    (wrong_conference, 1, ""),
]
NAMES = [make.__name__ for make, _, _ in HOSTILE]


@pytest.mark.parametrize(("make", "least", "told"), HOSTILE, ids=NAMES)
def test_reading_a_hostile_log_takes_bounded_memory_and_says_what_is_left_out(
    tmp_path: Path, make: Callable[[Path], Path], least: int, told: str
) -> None:
    log = make(tmp_path / "log.mcap")
    done = subprocess.run([sys.executable, "-c", READ, log], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert found["more_mb"] < MOST_MORE_MB
    assert found["read"] >= least
    assert any(told in line for line in found["damage"]) or not told, found["damage"]
    assert len(found["damage"]) <= MOST_TOLD
    assert all(line.isprintable() and len(line) < 3 * MOST_LETTERS for line in found["damage"])


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)], env={"COLUMNS": "160"})


QUICK = [case for case in HOSTILE if case[0] not in (all_of_one_time, more_messages_than_bytes)]


@pytest.mark.parametrize("make", [make for make, _, _ in QUICK], ids=lambda m: m.__name__)
def test_commands_tell_a_hostile_log_in_lines_and_end(tmp_path: Path, make: Callable[[Path], Path]) -> None:
    log = make(tmp_path / "log.mcap")
    for arguments in (("log", "info", log), ("replay", log, "--fast", "--out", tmp_path / "out"), ("replay", log, "--page")):
        if arguments[0] == "replay" and make is three_centuries:
            continue  # which has no conference file, as most of these
        result = call(*arguments)
        assert result.exit_code in (0, 1, 2)
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        assert "Traceback" not in result.output and "\x1b[2J" not in result.output
        if arguments[0] == "replay":
            assert result.exit_code, "there is nothing to be played"
            assert "the log" in result.stderr or "inside" in result.stderr or "holds no" in result.stderr


def test_the_page_of_a_hostile_log_says_what_is_damaged_and_serves_on(tmp_path: Path) -> None:
    async def seen() -> None:
        clock = SystemClock()
        file = tmp_path / "log.mcap"
        replays = Replays(load(DEMO_FILE), lambda: file, clock)
        app_ = web.Application()
        app_.router.add_get("/live", replays.watch)
        runner = web.AppRunner(app_)
        await runner.setup()
        site = web.TCPSite(runner, "127.0.0.1", 0)
        await site.start()
        address = "http://{}:{}/live".format(*runner.addresses[0][:2])
        for make in (expanding_chunk, as_many_channels_as_there_are_numbers, three_centuries, honest):
            make(file)
            async with aiohttp.ClientSession() as session, session.ws_connect(address) as socket:
                hello = await socket.receive_json()
                assert hello["kind"] == "hello" and len(hello["damage"]) <= MOST_TOLD
        await runner.cleanup()

    from vistel.wire import background

    asyncio.run(background.as_service("test", seen()))


def test_a_replay_opens_no_page_no_camera_and_no_figures_that_a_file_in_a_log_names(tmp_path: Path) -> None:
    token = "known-to-who-sent-it"
    opened = f'[monitoring]\nlisten = "0.0.0.0:9464"\n[console]\nat = "0.0.0.0:8440"\ntoken = "{token}"\n'
    named = f'stream = "0.0.0.0:8081"\nstream_token = "{token}"\nvirtual_camera = "auto"\nshared_memory = true\n'
    data = tomllib.loads(DEMO_FILE.read_text("utf-8") + opened)
    for site in data["sites"]:
        site["display"] = site.get("display", {}) | tomllib.loads(named)
    log = written(tmp_path / "log.mcap", [record(conference(tomli_w.dumps(data).encode()), one_message())])
    assert Conference.model_validate(LogReader(log).conference).console.at == "0.0.0.0:8440"
    played = of_replay(LogReader(log), log, None)
    assert not played.monitoring.listen and not played.console.at
    for site in played.sites:
        shown = site.display
        assert not (shown.stream or shown.virtual_camera or shown.shared_memory)


def test_an_honest_log_made_the_same_way_is_read(tmp_path: Path) -> None:
    reader = LogReader(honest(tmp_path / "log.mcap"))
    assert [r.names["participant"] for r in reader.records()] == ["ann"]
    assert reader.conference is not None
    assert zlib.crc32(b"") == 0  # chunks without a checksum are taken

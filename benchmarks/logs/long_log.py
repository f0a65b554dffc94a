"""A log as long, or as large, as wanted: the recorded meeting of the tests over and over."""

from pathlib import Path

from vistel.wire.log import LogReader, LogRecord, LogWriter

MEETING = Path(__file__).resolve().parents[2] / "tests/replay/meeting.mcap"
"""Two people with a FASTRAK and two CyberGloves each."""


def long_log(path: Path, seconds: float = 0.0, size: int = 0) -> Path:
    """A log of at least so many seconds and so many bytes at `path`."""
    reader = LogReader(MEETING)
    records = [r for r in reader.records() if r.topic.name != "participant"]
    length_ns = reader.end_ns - reader.begin_ns + 1
    with LogWriter(path, reader.conference_toml) as writer:
        for about in reader.records(("participant",)):
            writer.write(about.topic, about.key, about.message, reader.begin_ns)
        for _ in range(round(seconds * 1e9 / length_ns)):
            _append(writer, records, length_ns)
        while path.stat().st_size < size:
            _append(writer, records, length_ns)
    return path


def _append(writer: LogWriter, records: list[LogRecord], length_ns: int) -> None:
    """The meeting once more, and `records` as much later."""
    for r in records:
        writer.write(r.topic, r.key, r.message, r.message.header.t_ns)
        r.message.header.t_ns += length_ns

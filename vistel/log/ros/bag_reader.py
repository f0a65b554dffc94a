"""Reads a ROS 2 bag and hands on messages: `python -P bag_reader.py FOLDER TYPE...`. A script, because a package would load the
mathematics, and in a process of its own, whose memory is bounded: what a bag unpacks to is only known when it is unpacked.

On the standard output: a line of JSON, all topics as [name, type]; then each message of the given types as the number of its
topic u16, its time of arrival i64 [ns], its length u32, all little-endian, and its bytes (CDR). Else exit code 1 and one line on
the other.
"""

from __future__ import annotations

import json
import struct
import sys
from typing import Any

MOST_MEMORY = 4 << 30
"""Address space of this process [bytes]."""
_HEAD = struct.Struct("<HqI")


def _main(path: str, wanted: list[str]) -> int:
    try:
        from rosbags.rosbag2 import Reader
    except ImportError:
        sys.stderr.write("needs rosbags: pip install 'vistel[ros]'\n")
        return 1
    _bound_memory()
    out = sys.stdout.buffer
    try:
        with Reader(path) as reader:
            topics: list[Any] = list(reader.connections)
            out.write(json.dumps([[c.topic, c.msgtype] for c in topics]).encode() + b"\n")
            numbers = {c.id: n for n, c in enumerate(topics) if c.msgtype in wanted}
            chosen = [c for c in topics if c.id in numbers]
            for connection, t_ns, data in reader.messages(chosen) if chosen else ():
                out.write(_HEAD.pack(numbers[connection.id], t_ns, len(data)))
                out.write(data)
            out.flush()
    except BrokenPipeError:
        return 1  # whoever reads this has seen enough
    except MemoryError:
        sys.stderr.write(f"needs more than {MOST_MEMORY >> 30} GB to be unpacked\n")
        return 1
    except Exception as e:
        reason = str(e).splitlines()[0][:200] if str(e) else type(e).__name__
        sys.stderr.write(f"cannot be read as a bag of ROS 2, it is cut off or damaged: {reason}\n")
        return 1
    return 0


def _bound_memory() -> None:
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


if __name__ == "__main__":
    sys.exit(_main(sys.argv[1], sys.argv[2:]))

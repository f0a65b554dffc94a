"""Files of sensors: as the bytes of a tracker, from which postures are solved."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vistel.conference.device_names import tracker_name
from vistel.figure.skeleton import standard_skeleton
from vistel.log.sensors import DEVICE, Take, at_a_seat, read_capture, table_bytes
from vistel.v1.device_pb2 import RawBytes
from vistel.wire.raw_bytes import RawGatherer
from vistel.wire.topics import BY_NAME
from vistel_cli.log.imported.recorded import NAME, SITE, Messages, Recorded
from vistel_cli.terminal import err, print_warning

Read = tuple[float, bytes]
"""A time [s] and what a tracker said then."""


def sensors(path: Path, height: float, recorded: Take) -> Recorded:
    """A person with the sensors of a take."""
    reads, seconds = reads_of(path, path.name, height, recorded)
    person = tracked(path.stem, height, f"{DEVICE}@imported")
    return Recorded(seconds, [person], lambda _, begin_ns: worn(person, reads, begin_ns, reads[0][0]), solved=True)


def reads_of(path: Path, who: str, height: float, recorded: Take) -> tuple[list[Read], float]:
    """A take at a seat as what a tracker would have said, and its length [s]; what was changed is told."""
    take = at_a_seat(recorded)
    _tell(path, who, take.back, take.remark)
    return list(table_bytes(take, standard_skeleton(height))), take.seconds


def capture(path: Path, height: float) -> Recorded:
    """A person with the first tracker of what VRPN logged. Raises SensorError."""
    found = read_capture(path)
    first, *others = found.devices
    left_out = f"; the poses of {', '.join(others)} are left out" if others else ""
    _tell(path, path.name, found.back, f"the tracker {first}{left_out}")
    person = tracked(path.stem, height, f"{first}@imported")
    begin = found.reads[0][0]
    return Recorded(
        found.reads[-1][0] - begin, [person], lambda _, begin_ns: worn(person, found.reads, begin_ns, begin), solved=True
    )


def _tell(path: Path, who: str, back: int, remark: str) -> None:
    if back:
        print_warning(f"{path}: the time goes back {back} times; measurements are taken in the order of their times")
    err.print(f"{who}: {remark}", soft_wrap=True)  # above what is said of the wait


def tracked(name: str, height: float, port: str) -> dict[str, Any]:
    """Somebody with a tracker, as in a conference file."""
    tracker = {"kind": "vrpn", "port": port, "transmitter_position": [0.0, 0.0, 0.0]}
    return {"name": name, "height": height, "tracker": tracker, "gloves": {}}


def worn(person: dict[str, Any], reads: Sequence[Read], begin_ns: int, begin: float) -> Messages:
    """What the tracker of a person said; their name counts when the messages are made."""
    return raw(tracker_name(person["name"]), reads, begin_ns, begin)


def raw(device: str, reads: Sequence[Read], begin_ns: int, begin: float) -> Messages:
    """What a device said. begin: of the times of `reads` the one that is `begin_ns`."""
    topic = BY_NAME["device_raw"]
    key = topic.format(conference=NAME, site=SITE, device=device)
    gathered: list[RawBytes] = []
    gatherer = RawGatherer(device, gathered.append)
    for t, data in reads:
        gatherer.add(data, begin_ns + round((t - begin) * 1e9), RawBytes.DIRECTION_FROM_DEVICE)
    gatherer.flush()
    for n, message in enumerate(gathered):
        message.header.seq = n + 1
        after_ns = message.read_after_ns[-1] if message.read_after_ns else 0
        yield topic, key, message, message.header.t_ns + after_ns

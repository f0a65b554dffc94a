"""Recordings of a head and hands, as a guest who has entered with a headset."""

from pathlib import Path

import numpy as np

from vistel.conference.device_names import headset_name, pointer_name
from vistel.conference.model import Conference
from vistel.log.headsets.head_and_hands import HeadAndHands, records
from vistel.log.headsets.hololens import read_recording
from vistel.log.headsets.leap import read_leap
from vistel.protocol.pages.pointer import guest_record
from vistel_cli.log.imported.recorded import Assumed, Messages, Recorded
from vistel_cli.log.imported.sensors import raw
from vistel_cli.terminal import err, print_warning

ENTERS_EVERY_S = 0.25
"""As often as the gateway says who has a seat [s]."""


def hololens(path: Path, assumed: Assumed) -> Recorded:
    """Whoever wore a HoloLens. Raises SensorError."""
    found = read_recording(path, assumed.height, assumed.unit or "m")
    name = path.resolve().parent.name if path.name == "Export_py" else path.resolve().name
    return _guest(path, name, assumed, found, f"moved by {found.moved_m:.2f} m to the seat", "rows")


def leap(path: Path, assumed: Assumed) -> Recorded:
    """Whoever sat before a Leap Motion. Raises SensorError."""
    found = read_leap(path, assumed.height, assumed.unit or "mm")
    seen = " and ".join(f"the {side} hand in {_share(found, side):.0%} of frames" for side in found.hands)
    note = f"{seen}; the sensor is put on the table, and nothing else of the person was measured"
    return _guest(path, path.name.partition(".")[0], assumed, found, note, "frames")


def _guest(path: Path, name: str, assumed: Assumed, found: HeadAndHands, note: str, rows: str) -> Recorded:
    """Somebody with a headset. note: what was done with the file; rows: what it consists of."""
    if found.back:
        print_warning(f"{path}: the time goes back {found.back} times; {rows} are taken in the order of their times")
    usable = sum(1 for _ in records(found, 0))
    far = f"; {len(found.t) - usable} of {len(found.t)} {rows} are too far from the seat and left out"
    err.print(f"{path.name}: {note}{far if usable < len(found.t) else ''}", soft_wrap=True)
    person = {"name": name, "height": assumed.height, "guest": True}

    def messages(_: Conference, begin_ns: int) -> Messages:
        yield from raw(headset_name(person["name"]), list(records(found, begin_ns)), begin_ns, float(found.t[0]))
        yield from raw(pointer_name(person["name"]), _enters(found, person["name"]), begin_ns, float(found.t[0]))

    return Recorded(found.seconds, [person], messages, solved=True)


def _share(found: HeadAndHands, side: str) -> float:
    return 1.0 - float(np.isnan(found.hands[side][:, 0, 0]).mean())


def _enters(found: HeadAndHands, name: str) -> list[tuple[float, bytes]]:
    count = int(found.seconds / ENTERS_EVERY_S) + 1
    return [(float(found.t[0]) + n * ENTERS_EVERY_S, guest_record(name, "builtin")) for n in range(count)]

"""Recordings of a head and hands, as a guest who has entered with a headset."""

from pathlib import Path

from vistel.conference.device_names import headset_name, pointer_name
from vistel.conference.model import Conference
from vistel.log.headsets.hololens import HeadAndHands, read_recording, records
from vistel.protocol.pages.pointer import guest_record
from vistel_cli.log.imported.recorded import Messages, Recorded, Said
from vistel_cli.log.imported.sensors import raw
from vistel_cli.terminal import out, print_warning

ENTERS_EVERY_S = 0.25
"""As often as the gateway says who has a seat [s]."""


def hololens(path: Path, said: Said) -> Recorded:
    """Whoever wore a HoloLens. Raises SensorError."""
    found = read_recording(path, said.height, said.unit or "m")
    if found.back:
        print_warning(f"{path}: the time goes back {found.back} times; rows are taken in the order of their times")
    usable = sum(1 for _ in records(found, 0))
    far = (
        f"; {len(found.t) - usable} of {len(found.t)} rows are too far from the seat and left out" if usable < len(found.t) else ""
    )
    out.print(f"{path.name}: moved by {found.moved_m:.2f} m to the seat{far}", soft_wrap=True)
    person = {"name": path.resolve().parent.name if path.name == "Export_py" else path.resolve().name, "height": said.height}
    person |= {"guest": True}

    def messages(_: Conference, begin_ns: int) -> Messages:
        yield from raw(headset_name(person["name"]), list(records(found, begin_ns)), begin_ns, float(found.t[0]))
        yield from raw(pointer_name(person["name"]), _enters(found, person["name"]), begin_ns, float(found.t[0]))

    return Recorded(found.seconds, [person], messages, solved=True)


def _enters(found: HeadAndHands, name: str) -> list[tuple[float, bytes]]:
    count = int(found.seconds / ENTERS_EVERY_S) + 1
    return [(float(found.t[0]) + n * ENTERS_EVERY_S, guest_record(name, "builtin")) for n in range(count)]

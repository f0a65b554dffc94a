"""`vistel devices --watch`: every tracker and glove of a conference file, its firmware, rate and newest values."""

import asyncio
import math
from typing import Any

from rich.live import Live
from rich.table import Table
from rich.text import Text

from vistel.conference.model import Conference
from vistel.v1.device_pb2 import DeviceStatus, GloveFrame, TrackerFrame, TrackerReceiver
from vistel_cli.devices.session import running
from vistel_cli.terminal import out
from vistel_services import glove, tracker

_SHOWN_HZ = 5.0
_STATES = {DeviceStatus.STATE_STREAMING: "green", DeviceStatus.STATE_FAULT: "red", DeviceStatus.STATE_STALLED: "yellow"}


class Board:
    """The newest status and values of every device."""

    def __init__(self) -> None:
        self.status: dict[str, DeviceStatus] = {}
        self.frames: dict[str, TrackerFrame | GloveFrame] = {}

    def take_status(self, status: DeviceStatus) -> None:
        self.status[status.device] = status

    def take_frame(self, frame: TrackerFrame | GloveFrame) -> None:
        self.frames[frame.device] = frame

    def rows(self) -> list[dict[str, Any]]:
        """One for each device, by name."""
        return [
            {
                "device": name,
                "state": DeviceStatus.State.Name(s.state).removeprefix("STATE_").lower(),
                "about": s.detail,
                "rate_hz": round(s.rate_hz, 1),
                "bytes_skipped": s.bytes_skipped,
                "reconnects": s.reconnects,
                "values": _values(self.frames.get(name)),
            }
            for name, s in sorted(self.status.items())
        ]

    def tell_changes(self, told: dict[str, str]) -> dict[str, str]:
        """Prints a line for each device that is otherwise than `told`, where a table cannot be kept up to date. Returns what is
        told then."""
        now = {row["device"]: f"{row['device']} {row['state']}: {row['about']}" for row in self.rows()}
        for device, line in now.items():
            if told.get(device) != line:
                out.print(line, soft_wrap=True)
        return now

    def table(self) -> Table:
        table = Table("device", "state", "Hz", "about")
        table.add_column("newest values: cm, degrees", no_wrap=True)
        for row in self.rows():
            colour = _STATES.get(self.status[row["device"]].state, "default")
            table.add_row(
                row["device"], Text(row["state"], colour), f"{row['rate_hz']:.0f}", row["about"], "\n".join(row["values"])
            )
        return table


def _values(frame: TrackerFrame | GloveFrame | None) -> list[str]:
    if isinstance(frame, TrackerFrame):
        return [_receiver(r) for r in frame.receivers]
    if isinstance(frame, GloveFrame):
        degrees = [round(math.degrees(a)) for a in frame.angles]
        return [" ".join(f"{d:d}" for d in degrees[k : k + 4]) for k in range(0, len(degrees), 4)]
    return []


def _receiver(r: TrackerReceiver) -> str:
    health = TrackerReceiver.Health.Name(r.health).removeprefix("HEALTH_").lower()
    q = r.rotation
    turned = math.degrees(2.0 * math.acos(min(1.0, abs(q.w))))
    place = " ".join(f"{100.0 * v:7.1f}" for v in (r.position.x, r.position.y, r.position.z))
    return f"{r.station}: {place} {turned:3.0f}° {health}{' ' + r.error if r.error else ''}"


async def watch_devices(conference: Conference, seconds: float, *, as_json: bool) -> None:
    """Watch for `seconds`, or until Ctrl-C when it is 0. as_json: print the last values once, at the end."""
    board = Board()
    async with running(conference, (tracker, glove)) as session:
        session.listen("device_status", board.take_status)
        session.listen("tracker", board.take_frame)
        session.listen("glove", board.take_frame)
        told: dict[str, str] = {}
        end = asyncio.get_running_loop().time() + (seconds or math.inf)
        with Live(board.table(), console=out, refresh_per_second=_SHOWN_HZ, transient=as_json) as live:
            while asyncio.get_running_loop().time() < end:
                await asyncio.sleep(1.0 / _SHOWN_HZ)
                session.check()
                live.update(board.table())
                if not (as_json or out.is_terminal):
                    told = board.tell_changes(told)
    if as_json:
        out.print_json(data=board.rows())

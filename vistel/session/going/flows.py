"""What flows between the parts of a conference, as it reaches who counts it: how often, how much, how old, how much is lost."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from vistel.wire.link.arrivals import Arrived

WORLD = ""
"""In place of a site's name: what the world publishes, wherever it runs."""
FLOWS: dict[str, tuple[str, ...]] = {
    "motion": ("motion", "motion_thin"),
    "voice": ("voice", "voice_level"),
    "screen": ("screen",),
    "command": ("command",),
    "reports": ("device_status", "heartbeat", "clock_offset", "image_delay", "sound_status"),
    "world": ("world_state", "world_key"),
    "force": ("hand_force",),
    "answer": ("command_result",),
}
"""Topics of each flow."""
_FLOW_OF = {topic: flow for flow, topics in FLOWS.items() for topic in topics}


class Flows:
    """Call `now` about once a second."""

    def __init__(self) -> None:
        self._before: dict[str, tuple[int, int, int]] = {}
        self._before_ns: int | None = None

    def now(self, t_ns: int, of_key: Mapping[str, Arrived]) -> list[dict[str, Any]]:
        """A row for each flow of each site of which anything has arrived, ready for JSON; the first call knows no rates. of_key:
        what has arrived since the beginning; t_ns: conference time. Of a row: per_s messages, kbit_s, age_ms of the newest, lost as
        a share of what was sent since the call before."""
        seconds = 0.0 if self._before_ns is None else (t_ns - self._before_ns) * 1e-9
        groups: dict[tuple[str, str], list[tuple[str, Arrived]]] = {}
        for key, arrived in of_key.items():
            if arrived.topic in _FLOW_OF:
                groups.setdefault((arrived.names.get("site", WORLD), _FLOW_OF[arrived.topic]), []).append((key, arrived))
        rows = [
            {"site": site, "flow": flow, "age_ms": _age_ms(t_ns, group)} | self._rates(group, seconds)
            for (site, flow), group in sorted(groups.items())
        ]
        self._before = {key: (a.messages, a.bytes, a.lost or 0) for key, a in of_key.items()}
        self._before_ns = t_ns
        return rows

    def _rates(self, group: Iterable[tuple[str, Arrived]], seconds: float) -> dict[str, Any]:
        if seconds <= 0.0:
            return {}
        messages = size = lost = 0
        counted = True
        for key, now in group:
            before = self._before.get(key, (0, 0, 0))
            messages, size, lost = (
                messages + now.messages - before[0],
                size + now.bytes - before[1],
                lost + (now.lost or 0) - before[2],
            )
            counted = counted and now.lost is not None
        rates: dict[str, Any] = {"per_s": round(messages / seconds, 1), "kbit_s": round(size * 8e-3 / seconds, 1)}
        return rates | ({"lost": round(lost / (messages + lost), 4)} if counted and messages + lost else {})


def _age_ms(t_ns: int, group: Iterable[tuple[str, Arrived]]) -> float:
    """Of the newest. It may have been sent a little after `t_ns`: clocks differ, and it is taken after the clock has been read."""
    return round(max(0, t_ns - max(a.sent_ns for _, a in group)) * 1e-6, 1)

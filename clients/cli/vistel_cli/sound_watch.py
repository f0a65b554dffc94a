"""What the sites of a running conference hear, from the bus: who speaks, how late, how far from the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from vistel.v1.audio_pb2 import EquipmentStatus, SoundStatus
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME


@dataclass
class _Voice:
    to_ear_s: list[float] = field(default_factory=list)
    skew_s: list[float] = field(default_factory=list)
    frames: int = 0
    concealed: int = 0


class SoundWatch:
    """Call `poll` a few times a second."""

    def __init__(self, bus: Bus) -> None:
        self._status = bus.subscribe(BY_NAME["sound_status"], queue_all=True, polled=True)
        self._equipment = bus.subscribe(BY_NAME["equipment_status"], polled=True)
        self._newest: dict[str, SoundStatus] = {}
        self._voices: dict[tuple[str, str], _Voice] = {}
        self._devices: dict[tuple[str, str], EquipmentStatus] = {}

    def poll(self) -> None:
        """Take in what has arrived."""
        for sample in self._status.take():
            message: SoundStatus = sample.message
            self._newest[message.site] = message
            for s in message.streams:
                voice = self._voices.setdefault((message.site, s.participant), _Voice())
                voice.frames, voice.concealed = s.frames, s.concealed
                if s.talking:
                    voice.to_ear_s.append(s.actual_s)
                    if s.image_s:
                        voice.skew_s.append(s.skew_s)
        for sample in self._equipment.take():
            self._devices[sample.names["site"], sample.message.equipment] = sample.message

    def line(self, site: str) -> str:
        """In a few words what is heard at a site now; "" where it has no sound."""
        status = self._newest.get(site)
        if status is None:
            return ""
        speaking = [f"{s.participant} {s.skew_s * 1e3:+.0f} ms" for s in status.streams if s.talking]
        warnings = [f"{m.participant}: no microphone" for m in status.microphones if not m.open and not m.muted]
        warnings += [f"{m.participant} muted" for m in status.microphones if m.muted]
        warnings += [f"{m.participant} too loud" for m in status.microphones if m.clipped]
        warnings += [] if status.acoustic_known else ["acoustic delay unknown"]
        return ", ".join([*(f"♪ {s}" for s in speaking), *warnings])

    def report(self, sites: Sequence[str]) -> dict[str, Any]:
        """Of the whole run, as JSON-ready data, by site; seconds."""
        out: dict[str, Any] = {}
        for site in sites:
            status = self._newest.get(site)
            if status is None:
                continue
            out[site] = {
                "policy": status.policy,
                "loudspeaker": status.loudspeaker_detail or status.loudspeaker,
                "voices": {who: _figures(v) for (where, who), v in sorted(self._voices.items()) if where == site},
                "microphones": {m.participant: m.detail or m.source for m in status.microphones},
                "equipment": {
                    name: EquipmentStatus.State.Name(d.state).removeprefix("STATE_").lower() + (f": {d.detail}" if d.detail else "")
                    for (where, name), d in sorted(self._devices.items()) if where == site
                },
            }  # fmt: skip
        return out


def _figures(voice: _Voice) -> dict[str, Any]:
    early, late = (_share(voice.skew_s, 0.01), _share(voice.skew_s, 0.99)) if voice.skew_s else (None, None)
    return {
        "mouth_to_ear_s_median": _share(voice.to_ear_s, 0.5) if voice.to_ear_s else None,
        "skew_s_median": _share(voice.skew_s, 0.5) if voice.skew_s else None,
        "skew_s_p1": early, "skew_s_p99": late, "frames": voice.frames, "concealed": voice.concealed,
    }  # fmt: skip


def _share(values: list[float], share: float) -> float:
    ordered = sorted(values)
    return round(ordered[min(len(ordered) - 1, int(share * len(ordered)))], 4)

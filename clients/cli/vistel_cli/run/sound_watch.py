"""Sound at the sites of a running conference, from the bus: speakers, delays, and skew to the picture."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from vistel.v1.audio_pb2 import EquipmentStatus, SoundStatus
from vistel.v1.speech_pb2 import Utterance
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME

_MARKS = {
    Utterance.STATE_SENT: "…",
    Utterance.STATE_DONE: "✓",
    Utterance.STATE_REFUSED: "✗",
    Utterance.STATE_QUESTION: "?",
    Utterance.STATE_REJECTED: "?",
}


def caption(message: Utterance) -> str:
    """A spoken command and its outcome, in one line."""
    answer = "" if message.state in (Utterance.STATE_SENT, Utterance.STATE_DONE) or not message.reply else f" {message.reply}"
    said = f"“{message.text}” " if message.text else ""
    return f"{message.participant}: {said}{_MARKS.get(message.state, '')}{answer}"


MOST_KEPT = 7200
"""Of the values of a figure, for its median in the report: the newest, of an hour or so."""


def newest() -> deque[float]:
    """A list that lets its oldest values go."""
    return deque(maxlen=MOST_KEPT)


@dataclass
class _Voice:
    target_s: deque[float] = field(default_factory=newest)
    to_ear_s: deque[float] = field(default_factory=newest)
    skew_s: deque[float] = field(default_factory=newest)
    frames: int = 0
    concealed: int = 0


class SoundWatch:
    """Call `poll` a few times a second."""

    def __init__(self, bus: Bus) -> None:
        self._status = bus.subscribe(BY_NAME["sound_status"], queue_all=True, polled=True)
        self._equipment = bus.subscribe(BY_NAME["equipment_status"], polled=True)
        self._utterances = bus.subscribe(BY_NAME["utterance"], queue_all=True, polled=True)
        self._said: dict[str, dict[str, Utterance]] = {}
        self._unshown: list[Utterance] = []
        self._newest: dict[str, SoundStatus] = {}
        self._voices: dict[tuple[str, str], _Voice] = {}
        self._devices: dict[tuple[str, str], EquipmentStatus] = {}

    def poll(self) -> None:
        """Process the messages received since the last call."""
        for sample in self._status.take():
            message: SoundStatus = sample.message
            self._newest[message.site] = message
            for s in message.streams:
                voice = self._voices.setdefault((message.site, s.participant), _Voice())
                voice.frames, voice.concealed = s.frames, s.concealed
                if s.talking:
                    voice.target_s.append(s.target_s)
                    voice.to_ear_s.append(s.actual_s)
                    if s.HasField("skew_s"):
                        voice.skew_s.append(s.skew_s)
        for sample in self._utterances.take():
            said = self._said.setdefault(sample.names["site"], {})
            said.pop(sample.message.id, None)
            said[sample.message.id] = sample.message
            self._unshown.append(sample.message)
        for sample in self._equipment.take():
            self._devices[sample.names["site"], sample.message.equipment] = sample.message

    def heard(self, site: str) -> list[str]:
        """The voices that are heard at a site now, each with its delay and skew."""
        status = self._newest.get(site)
        return [_heard(s) for s in status.streams if s.talking] if status else []

    def warnings(self, site: str) -> list[str]:
        """What is wrong with the sound of a site now."""
        status = self._newest.get(site)
        if status is None:
            return []
        warnings = [
            f"{m.participant}: no microphone{f': {m.detail}' if m.detail else ''}"
            for m in status.microphones
            if not m.open and not m.muted
        ]
        warnings += [f"{m.participant} is muted" for m in status.microphones if m.muted]
        warnings += [f"{m.participant} is too loud" for m in status.microphones if m.clipped]
        warnings += [f"no loudspeaker: {status.loudspeaker_detail}"] if status.loudspeaker_detail else []
        return warnings + ([] if status.acoustic_known else ["acoustic delay unknown"])

    def new_captions(self) -> list[str]:
        """What was said to the room, and its outcome, since the last call."""
        new = [caption(m) for m in self._unshown if m.state != Utterance.STATE_SENT]
        self._unshown.clear()
        return new

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
                "said_to_the_room": [caption(m) for m in self._said.get(site, {}).values()],
                "microphones": {m.participant: m.detail or m.source for m in status.microphones},
                "equipment": {
                    name: EquipmentStatus.State.Name(d.state).removeprefix("STATE_").lower() + (f": {d.detail}" if d.detail else "")
                    for (where, name), d in sorted(self._devices.items())
                    if where == site
                },
            }
        return out


def _heard(s: SoundStatus.Stream) -> str:
    """Delay of a voice, its target when that differs, and its skew to the picture."""
    more = [f"wanted {s.target_s * 1e3:.0f}"] if abs(s.target_s - s.actual_s) >= 0.005 else []
    more += [f"{s.skew_s * 1e3:+.0f}"] if s.HasField("skew_s") else []
    extra = f" ({', '.join(more)})" if more else ""
    return f"{s.participant} {s.actual_s * 1e3:.0f} ms{extra}"


def _figures(voice: _Voice) -> dict[str, Any]:
    early, late = (_share(voice.skew_s, 0.01), _share(voice.skew_s, 0.99)) if voice.skew_s else (None, None)
    return {
        "target_s_median": _share(voice.target_s, 0.5) if voice.target_s else None,
        "mouth_to_ear_s_median": _share(voice.to_ear_s, 0.5) if voice.to_ear_s else None,
        "skew_s_median": _share(voice.skew_s, 0.5) if voice.skew_s else None,
        "skew_s_p1": early,
        "skew_s_p99": late,
        "frames": voice.frames,
        "concealed": voice.concealed,
    }


def _share(values: Iterable[float], share: float) -> float:
    ordered = sorted(values)
    return round(ordered[min(len(ordered) - 1, int(share * len(ordered)))], 4)

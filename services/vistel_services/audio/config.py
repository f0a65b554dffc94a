"""The sound of a site, from the conference file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from vistel.audio.delay_policy import MATCH, Policy
from vistel.audio.spatial_mode import SpatialMode
from vistel.conference.device_names import microphone_name
from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths


@dataclass(frozen=True)
class Microphone:
    """source: as in the conference file, or the path of a simulated microphone's pipe."""

    participant: str
    source: str
    push_to_talk: bool = False


@dataclass(frozen=True)
class Config:
    """listener: the participant for whom voices get directions; loudspeaker: as in the conference file; latency_s: from the
    sound card to the ear; delay_unit: name of the unit between sound card and loudspeaker, "" for none; memory: file of the
    microphones' switches; pages: guests of this site, whose voices the gateway passes on."""

    site: str
    listener: str
    microphones: tuple[Microphone, ...] = ()
    loudspeaker: str = "none"
    policy: Policy = MATCH
    spatial: SpatialMode = "pan"
    stream: bool = True
    bitrate: int = 24_000
    repeats: int = 1
    latency_s: float = 0.0
    delay_unit: str = ""
    memory: Path | None = None
    crowd: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """See `Conference.crowd`."""
    pages: tuple[str, ...] = ()


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> Config | None:
    """The sound of `site`; None if it has none."""
    if site is None:
        raise ValueError("audio: runs at a site, but none is given")
    audio = site.audio
    if audio is None:
        return None
    microphones: list[Microphone] = []
    for person in site.participants:
        source = site.microphone_of(person)
        if source == "sim":
            source = str(paths.device(microphone_name(person.name)))
        if source not in ("none", "page"):
            microphones.append(Microphone(person.name, source, audio.push_to_talk))
    loudspeaker = audio.loudspeaker
    if loudspeaker.lower().endswith(".wav"):
        loudspeaker = str(paths.out / Path(loudspeaker))
    unit = next((e.name for e in audio.equipment if e.role == "delay"), "")
    return Config(
        site.name,
        site.participants[0].name,
        tuple(microphones),
        loudspeaker,
        audio.policy,
        audio.spatial,
        audio.stream,
        audio.bitrate,
        audio.repeats,
        audio.latency,
        unit,
        paths.run / f"{site.name}-microphones.json",
        conference.crowd,
        tuple(p.name for p in site.participants if p.by_link),
    )

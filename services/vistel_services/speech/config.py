"""What a site's people may say, from the conference file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.conference.speech import Spoken
from vistel.speech.engines.choice import Chosen


@dataclass(frozen=True)
class Speaker:
    """Somebody whose microphone is listened to. voice: what enrolment learnt of them; engine: what hears them, where
    that is not the language's own recogniser."""

    participant: str
    language: Spoken = "ja"
    voice: Path | None = None
    engine: Chosen | None = None


@dataclass(frozen=True)
class Config:
    """See `vistel.conference.speech.Speech`."""

    site: str
    speakers: tuple[Speaker, ...]
    listen: Literal["open", "push", "wake"] = "open"
    grammars: tuple[Path, ...] = ()
    accept: float = 0.5
    reply: Literal["spoken", "text", "none"] = "text"


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> Config | None:
    """The speech of `site`; None where nobody speaks to the room, or none of them has a microphone."""
    if site is None:
        raise ValueError("speech: runs at a site, but none is given")
    speech = site.speech
    if speech is None:
        return None
    speakers: list[Speaker] = []
    for person in site.participants:
        if site.microphone_of(person) == "none":
            continue
        learnt = speech.voices / f"{person.name}.npz" if speech.voices is not None else None
        language = speech.language_of(person.name)
        engine = Chosen(speech.engine, speech.model) if speech.engine != "own" and language == speech.language else None
        speakers.append(Speaker(person.name, language, learnt if learnt and learnt.is_file() else None, engine))
    return Config(site.name, tuple(speakers), speech.listen, tuple(speech.grammar), speech.accept, speech.reply)

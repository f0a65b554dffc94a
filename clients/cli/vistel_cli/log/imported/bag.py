"""Bags of ROS 2: their frames as sensors, their sound as voices, their pictures as films beside the log."""

import re
from pathlib import Path
from typing import Any

from vistel.conference.model import Conference
from vistel.log.ros.bag import Bag, Sound, pictures, read_bag
from vistel.log.ros.film import write_film
from vistel.log.ros.frames import people_of, take_of
from vistel.log.ros.sound import voice_of
from vistel.log.sensors import DEVICE, SensorError
from vistel.v1.audio_pb2 import Voice
from vistel.wire.topics import BY_NAME
from vistel_cli.log.imported.recorded import NAME, SITE, Assumed, Film, Messages, Recorded
from vistel_cli.log.imported.sensors import Read, reads_of, tracked, worn
from vistel_cli.terminal import print_warning

BESIDE_S = 60.0
"""Sound that is farther from all that the sensors say is of another time [s]."""


def bag(path: Path, assumed: Assumed) -> Recorded:
    """The people of a bag. Raises SensorError."""
    found = read_bag(path)
    people: list[dict[str, Any]] = []
    reads: list[list[Read]] = []
    voices: list[Sound | None] = []
    named = people_of(found, assumed.frames)
    for name, frames in named.items():
        take = take_of(found, frames, assumed.unit or "m", assumed.up or "z")
        told, _ = reads_of(path, f"{path.name}, {name}" if name else path.name, assumed.height, take)
        people.append(tracked(name.replace("/", "-") or path.resolve().name, assumed.height, f"{DEVICE}@imported"))
        reads.append(told)
        voices.append(_sound_of(found, name, alone=len(named) == 1))
    first, last = min(r[0][0] for r in reads), max(r[-1][0] for r in reads)
    voices = [sound if sound and first - BESIDE_S < sound.messages[0][0] < last + BESIDE_S else None for sound in voices]
    for sound in found.sounds:
        if sound not in voices:
            print_warning(f"{path}: {sound.topic}: is left out: it is nobody's voice, or of another time")
    spoken = [(person, list(voice_of(path, sound))) for person, sound in zip(people, voices, strict=True) if sound]
    begin = min([first, *(frames[0].header.t_ns * 1e-9 for _, frames in spoken if frames)])

    def messages(_: Conference, begin_ns: int) -> Messages:
        for person, told in zip(people, reads, strict=True):
            yield from worn(person, told, begin_ns, begin)
        for person, frames in spoken:
            yield from _voice(person, frames, begin_ns, begin)

    films = [Film(re.sub(r"\W+", "-", topic.strip("/")), _writer(found, topic, begin)) for topic in found.picture_topics]
    return Recorded(last - begin, people, messages, solved=True, films=films)


def _sound_of(found: Bag, name: str, alone: bool) -> Sound | None:
    """Whose name is in the topic has that voice; who is alone has the first."""
    named = [sound for sound in found.sounds if name and f"/{name}/" in sound.topic]
    return next(iter(named or (found.sounds if alone else [])), None)


def _voice(person: dict[str, Any], frames: list[Voice], begin_ns: int, begin: float) -> Messages:
    topic = BY_NAME["voice"]
    key = topic.format(conference=NAME, site=SITE, participant=person["name"])
    for n, frame in enumerate(frames):
        message = Voice()
        message.CopyFrom(frame)
        message.header.seq, message.header.t_ns = n + 1, begin_ns + frame.header.t_ns - round(begin * 1e9)
        yield topic, key, message, message.header.t_ns


def _writer(found: Bag, topic: str, begin: float) -> Any:
    def write(path: Path, after_s: float) -> str:
        shown = ((t - begin - after_s, picture) for t, picture in pictures(found, topic))
        count, first, last = write_film(f"{found.path}: {topic}", shown, path)
        if not count:
            raise SensorError(f"{found.path}: {topic}: no picture is of the time of the sensors")
        return f"{count} pictures of {topic}, {first:.1f} s to {last:.1f} s of the log, written to {path}"

    return write

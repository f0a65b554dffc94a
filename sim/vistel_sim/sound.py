"""The simulated microphones of a conference, and its simulated equipment on Modbus."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from vistel.conference.device_list import simulated_microphones_of
from vistel.conference.device_names import equipment_name, microphone_name
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire.clock import Clock
from vistel_sim.faults import Fault
from vistel_sim.microphone import SimulatedMicrophone, SimulatedVoice
from vistel_sim.motion.source import Clapper
from vistel_sim.sentences import Sentences
from vistel_sim.simulation import BodyMotion, device_seed

if TYPE_CHECKING:
    from vistel_sim.equipment.modbus_unit import SimulatedUnit


def simulated_microphones(
    conference: Conference, motion: BodyMotion, paths: RunPaths, *, site: str | None = None, faults: Iterable[Fault] = ()
) -> list[SimulatedMicrophone]:
    """The simulated microphones of one site or of all."""
    faults = tuple(faults)
    out: list[SimulatedMicrophone] = []
    for person in (p for s in conference.sites if site in (None, s.name) for p in simulated_microphones_of(s)):
        name = microphone_name(person.name)
        seed = device_seed(conference.seed, name)
        sentences = Sentences(person.says) if person.says else None
        voice = SimulatedVoice(partial(motion.speaking, person.name), partial(_claps_of, motion, person.name), seed, sentences)
        out.append(SimulatedMicrophone(name, voice, paths.device(name), faults, seed=seed))
    return out


def simulated_equipment(
    conference: Conference, paths: RunPaths, clock: Clock, start_ns: int, *, site: str | None = None, faults: Iterable[Fault] = ()
) -> list[SimulatedUnit]:
    """The equipment whose address is "sim" or "sim:rtu"."""
    sites = [(s.name, s.audio) for s in conference.sites if site in (None, s.name)]
    wanted = [(name, e) for name, audio in sites if audio is not None for e in audio.equipment if e.simulated]
    if not wanted:
        return []
    from vistel_sim.equipment.delay_unit import SimulatedDelayUnit  # noqa: PLC0415  few conferences load Modbus
    from vistel_sim.equipment.room_device import SimulatedRoomDevice  # noqa: PLC0415

    faults = tuple(faults)
    out: list[SimulatedUnit] = []
    for site_name, e in wanted:
        name = equipment_name(site_name, e.name)
        own, baud = device_seed(conference.seed, name), e.baud if e.address == "sim:rtu" else 0
        at = (name, paths.device(name), clock, start_ns, faults)
        if e.role == "delay":
            channels = max(2, e.channel)
            out.append(SimulatedDelayUnit(*at, channels=channels, baud=baud, device_id=e.device_id, seed=own))
        else:
            out.append(SimulatedRoomDevice(*at, registers=e.map(), baud=baud, device_id=e.device_id, seed=own))
    return out


def _claps_of(motion: BodyMotion, participant: str, start_s: float, end_s: float) -> Sequence[float]:
    return motion.claps(participant, start_s, end_s) if isinstance(motion, Clapper) else ()

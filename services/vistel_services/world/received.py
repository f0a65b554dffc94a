"""Collects what arrives between two steps: who is there, their newest motion, where tracked things are, commands,
who has gone. Whom each site may speak for, the bus has seen to (`vistel.wire.owners`)."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from prometheus_client import Counter

from vistel.messages.world.decode import motion_input, person
from vistel.space.inputs import MotionInput, ParticipantBody
from vistel.space.things.props import SILENT_NS as PROP_SILENT_NS
from vistel.v1.command_pb2 import Command
from vistel.v1.device_pb2 import TrackerReceiver
from vistel.v1.motion_pb2 import Prop
from vistel.wire.bus import Sample
from vistel.wire.clock import STEP_NS
from vistel.wire.motion import MotionDecoder
from vistel.wire.motion.interest import STRAY_NS

log = logging.getLogger("vistel.world")

_UNDECODED = Counter("vistel_world_motion_undecoded_total", "Motions whose key frame is missing", ["participant"])

SILENT_NS = 5_000_000_000
"""Somebody without motion for so long has left; the next motion brings them back."""
LEASE_NS = 2_000_000_000
"""A site none of whose processes is present for so long has left."""
OLDEST_COMMAND_NS = 5_000_000_000
"""Commands older than this on arrival were meant for a world of the past."""
MOST_COMMANDS = 256
"""Of one participant between two steps; more are dropped. The world does far fewer a second."""
CLOCK_RESTART_NS = STEP_NS
"""A motion this much older than the last begins a new life of its sender, or its clock was set."""


_USABLE = (TrackerReceiver.HEALTH_UNSPECIFIED, TrackerReceiver.HEALTH_GOOD, TrackerReceiver.HEALTH_FLAGGED)


@dataclass
class _PropSource:
    """Which site publishes a prop. over: it has let go of it, and only its newest message counts."""

    site: str
    heard_ns: int
    t_ns: int
    over: bool = False


@dataclass
class _Somebody:
    site: str
    person: ParticipantBody
    heard_ns: int
    last_motion_ns: int = 0
    moves: bool = False


@dataclass
class ReceivedInputs:
    """What is new for one step."""

    people: list[ParticipantBody] = field(default_factory=list)
    motions: list[MotionInput] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    commands: list[tuple[str, Command]] = field(default_factory=list)
    props: list[Prop] = field(default_factory=list)
    late: list[tuple[str, Command, str]] = field(default_factory=list)
    """Commands that came too late to be done, and why."""


class InputCollector:
    """Takes samples as they are received, and gives what is new for each step. Times are conference time [ns]."""

    def __init__(self) -> None:
        self._known: dict[str, ParticipantBody] = {}
        self._people: dict[str, _Somebody] = {}
        self._decoders: dict[str, MotionDecoder] = {}
        self._tokens: dict[str, set[str]] = {}
        self._gone_ns: dict[str, int] = {}
        self._newest: dict[str, MotionInput] = {}
        self._props: dict[str, _PropSource] = {}
        self._newest_props: dict[tuple[str, str], Prop] = {}
        self._arrived = ReceivedInputs()
        self._told: set[tuple[str, str]] = set()
        self._asked: dict[str, int] = {}
        self._behind_ns: dict[str, int] = {}
        self._left_by_word: set[str] = set()
        """Who said that they left: what was on its way still does not bring them back."""

    def adopt(self, present: Mapping[str, int], recent: Sequence[ReceivedInputs], now_ns: int) -> None:
        """Go on with a world in which somebody is already. present: who, and the time of the motion that the world knows
        [ns]; they leave again unless heard of. recent: what arrived of late, of which the world may have taken some."""
        for name, somebody in self._people.items():
            if name not in present and somebody.person not in self._arrived.people:
                self._arrived.people.append(somebody.person)
        for name in present:
            if name not in self._people:
                self._people[name] = _Somebody("", self._known.get(name, ParticipantBody(name)), now_ns, moves=True)
        for batch in recent:
            # Commands that were done are answered again and not done again.
            self._arrived.commands.extend(batch.commands)
            self._newest |= {m.participant: m for m in batch.motions if m.t_ns > present.get(m.participant, 0)}

    def follows(self, names: Iterable[str]) -> bool:
        """Whether the motions of all of them can be read: each stream has had its key frame."""
        return all(name in self._people and self._people[name].last_motion_ns for name in names)

    def presence(self, site: str, token: str, alive: bool, now_ns: int) -> None:
        """A process of a site came or went."""
        tokens = self._tokens.setdefault(site, set())
        (tokens.add if alive else tokens.discard)(token)
        if tokens:
            self._gone_ns.pop(site, None)
        else:
            self._gone_ns[site] = now_ns

    def participant(self, sample: Sample) -> None:
        """Somebody says who they are."""
        name, site = sample.names["participant"], sample.names["site"]
        if sample.message.left:
            self._left_by_word.add(name)
            if name in self._people:
                self._leave(name, "by word")
            return
        self._left_by_word.discard(name)
        self._known[name] = person(name, sample.message)
        if name in self._people:
            if self._people[name].person != self._known[name]:
                self._people[name].person = self._known[name]
                self._arrived.people.append(self._known[name])
        elif site not in self._gone_ns:
            self._join(name, site, sample.received_ns)

    def motion(self, sample: Sample) -> None:
        """Somebody moved. Every message is decoded, the newest is kept."""
        name, site = sample.names["participant"], sample.names["site"]
        decoder = self._decoders.setdefault(sample.key, MotionDecoder())
        decoded = decoder.decode(sample.message)
        if decoded is None:
            _UNDECODED.labels(name).inc()
            return
        if name in self._left_by_word:
            return
        if name not in self._people:
            self._join(name, site, sample.received_ns)
        self._behind_ns[site] = sample.received_ns - decoded.t_ns
        somebody = self._people[name]
        somebody.site, somebody.heard_ns, somebody.moves = site, sample.received_ns, True
        stray_ns = STRAY_NS if sample.topic.name == "motion_thin" else CLOCK_RESTART_NS
        if somebody.last_motion_ns - stray_ns < decoded.t_ns <= somebody.last_motion_ns:
            return
        somebody.last_motion_ns = decoded.t_ns
        self._newest[name] = motion_input(name, decoded)

    def prop(self, sample: Sample) -> None:
        """A tracked thing is somewhere. The newest is kept; of several whose mice lead a thing, the site that was heard first
        does, until it lets go of it or falls silent."""
        thing, site, message = sample.names["thing"], sample.names["site"], sample.message
        if message.thing != thing or message.health not in _USABLE:
            return
        source = self._props.get(thing)
        silent = source is None or sample.received_ns - source.heard_ns > PROP_SILENT_NS
        if source is None or silent or (source.over and source.site != site):
            self._props[thing] = source = _PropSource(site, sample.received_ns, 0)
            log.info("prop followed thing=%s site=%s", thing, site)
        if source.site != site:
            if (thing, site) not in self._told and not message.let_go:
                self._told.add((thing, site))
                log.warning("two sites send one prop=%s heard=%s ignored=%s", thing, source.site, site)
            return
        source.heard_ns, t_ns = sample.received_ns, message.header.t_ns
        if source.t_ns - CLOCK_RESTART_NS < t_ns <= source.t_ns:
            return
        source.t_ns, source.over = t_ns, message.let_go
        self._newest_props[thing, message.led_by] = message

    def command(self, sample: Sample) -> None:
        """Somebody asks for something."""
        t_ns, who = sample.message.header.t_ns, sample.names["participant"]
        self._asked[who] = self._asked.get(who, 0) + 1
        if self._asked[who] > MOST_COMMANDS:
            return
        late_ns = sample.received_ns - t_ns
        if t_ns and late_ns > OLDEST_COMMAND_NS:
            self._arrived.late.append((who, sample.message, self._why_late(sample.names["site"], late_ns)))
        else:
            self._arrived.commands.append((who, sample.message))

    def _why_late(self, site: str, late_ns: int) -> str:
        behind_ns = self._behind_ns.get(site, 0)
        if behind_ns > CLOCK_RESTART_NS:
            return f"the clock of {site} is {behind_ns * 1e-9:.0f} s behind the conference's; it is being set, ask again"
        return f"it came {late_ns * 1e-9:.0f} s after it was asked; ask again"

    def take(self, now_ns: int) -> ReceivedInputs:
        """What is new since the last call."""
        for name, somebody in sorted(self._people.items()):
            silent = somebody.moves and now_ns - somebody.heard_ns > SILENT_NS
            gone_ns = self._gone_ns.get(somebody.site)
            gone = gone_ns is not None and now_ns - max(gone_ns, somebody.heard_ns) > LEASE_NS
            if silent or gone:
                self._leave(name, "site gone" if gone else "no motion")
        for who, count in self._asked.items():
            if count > MOST_COMMANDS:
                log.warning("commands dropped participant=%s count=%d", who, count - MOST_COMMANDS)
        self._asked.clear()
        out = self._arrived
        out.motions = [self._newest[name] for name in sorted(self._newest)]
        # Who lets go of a thing comes before who takes it in the same step.
        out.props = sorted(self._newest_props.values(), key=lambda p: (p.thing, not p.let_go, p.led_by))
        self._arrived, self._newest, self._newest_props = ReceivedInputs(), {}, {}
        return out

    def _leave(self, name: str, reason: str) -> None:
        log.info("participant left participant=%s reason=%s", name, reason)
        del self._people[name]
        self._newest.pop(name, None)
        self._arrived.left.append(name)

    def _join(self, name: str, site: str, now_ns: int) -> None:
        known = self._known.get(name, ParticipantBody(name))
        self._people[name] = _Somebody(site, known, now_ns)
        self._arrived.people.append(known)
        if name in self._arrived.left:  # back before the next step
            self._arrived.left.remove(name)
        log.info("participant joined participant=%s site=%s", name, site)

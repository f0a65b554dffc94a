"""Who and what is in the room, buffered until it is shown. Knows no graphics and no clock.

Messages are received on the event loop. `instant` may be called on another thread while the loop receives none; avatars may arrive
or be refused meanwhile.
"""

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from vistel.audio.heard_voices import HeardVoices, Speech
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.face.blink import blinking
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.skeleton import standard_skeleton
from vistel.render.stage.arrivals import AdaptiveDelay
from vistel.render.stage.captions import Caption, Captions
from vistel.render.stage.hand_correction import ShownPerson
from vistel.render.stage.held import HeldThings
from vistel.render.stage.motion import InterpolatedPosture, MotionReader, PredictedPosture, ShownPosture
from vistel.render.stage.playout import Playout, Timing
from vistel.render.stage.screens import DecodedScreens, Shown
from vistel.render.stage.world_view import ActingGhost, PlayoutWorld, between, ghosts_from, thing_of, view_of, world_after
from vistel.space.things.things import Pages, Thing
from vistel.v1 import audio_pb2, motion_pb2, world_pb2
from vistel.wire.motion.proportions import from_message
from vistel.wire.parcels import is_digest
from vistel.wire.world.decoder import RoomState, Touch

log = logging.getLogger("vistel.renderer")

MOST_WAIT_S = 0.6
"""A picture waits no longer for its voice."""
TOGETHER_NS = 25_000_000
"""Whose delay is that of the room within this is shown at one moment with it, so that hands are where things feel them."""
TOUCHED_NS = 500_000_000
"""Who touched somebody a moment ago is about to again: hands that shake do so several times."""
GONE_NS = 20_000_000_000
"""A participant from whom nothing is received for so long is no longer drawn."""


_LOOK_NS = 33_333_333
"""From one look of `looks_before` to the next."""
_LOOKS = 12
"""So many: in that time, hands have come to what they hold."""


def looks_before(now_ns: int, since_ns: int | None = None) -> list[int]:
    """Moments at which a stage is asked first by who begins to look at `now_ns`, or looked last at `since_ns`. Hands on their way
    to what they hold, and those things, are then where who has looked all along sees them (`HeldThings`)."""
    looks = range(now_ns - _LOOKS * _LOOK_NS, now_ns, _LOOK_NS)
    return [t_ns for t_ns in looks if since_ns is None or t_ns > since_ns]


@dataclass(frozen=True)
class ParticipantInfo:
    """Who a participant is. parcel: digest of an avatar of their own; proportions: what its limbs are like; here: it need
    not be waited for."""

    name: str
    display_name: str
    avatar: str = "builtin"
    height: float = 1.75
    parcel: str = ""
    proportions: Proportions | None = None
    here: bool = True


def described(message: motion_pb2.Participant) -> ParticipantInfo:
    """Who a message describes. Somebody with an avatar of their own is not `here` before it is."""
    parcel = message.parcel if is_digest(message.parcel) else ""
    return ParticipantInfo(
        message.participant,
        message.display_name or message.participant,
        message.avatar or "builtin",
        message.height_m if 0.5 <= message.height_m <= 2.6 else 1.75,
        parcel,
        _limbs(message),
        not parcel,
    )


@dataclass(frozen=True)
class PersonNow:
    """A participant at the instant shown."""

    about: ParticipantInfo
    posture: Posture
    timing: Timing


@dataclass(frozen=True)
class Instant:
    """Everything that is shown at one instant; now_ns: conference time at which it is drawn.

    coming: who has been announced and has not moved yet, so that their figures can be made ready. talking: who is heard.
    captions: what was said to the room lately. speech: of who speaks, as it was when their motion that is shown was captured.
    screens: what participants show live.
    """

    now_ns: int
    people: tuple[PersonNow, ...] = ()
    world: PlayoutWorld = field(default_factory=PlayoutWorld)
    things: Mapping[str, Thing] = field(default_factory=lambda: MappingProxyType({}))
    coming: tuple[ParticipantInfo, ...] = ()
    talking: frozenset[str] = frozenset()
    captions: tuple[Caption, ...] = ()
    speech: Mapping[str, Speech] = field(default_factory=lambda: MappingProxyType({}))
    screens: Mapping[str, Shown] = field(default_factory=lambda: MappingProxyType({}))


class _Person:
    def __init__(self, about: ParticipantInfo, delay: int | AdaptiveDelay, site: str = "") -> None:
        self.about, self.site = about, site
        self.reader, self.thin_reader = MotionReader(), MotionReader()
        self.playout: Playout[ShownPosture] = Playout(InterpolatedPosture, delay, PredictedPosture)


class Stage:
    """Receives messages and gives the instants that are shown."""

    def __init__(self, delay: int | AdaptiveDelay, own: frozenset[str] = frozenset()) -> None:
        """delay: from capture to what is shown, fixed [ns] or following the network. own: who looks at these pictures: they see
        themselves, and what they alone hold, without delay, but while they touch somebody else."""
        self._delay, self._own = delay, own
        self._people: dict[str, _Person] = {}
        self._things: Mapping[str, Thing] = MappingProxyType({})
        self._described: Mapping[str, world_pb2.Thing] = MappingProxyType({})
        self._looks: frozenset[str] = frozenset()
        self._pages: frozenset[str] = frozenset()
        self._touches: tuple[Touch, ...] = ()
        self._ghosts: tuple[ActingGhost, ...] = ()
        self._world: Playout[PlayoutWorld] = Playout(between, delay, world_after)
        self._arrived: set[str] = set()
        self._left: set[str] = set()
        self._held = HeldThings()
        self._touched_ns: dict[str, int] = {}
        self._talking: frozenset[str] = frozenset()
        self._voices = HeardVoices()
        self.captions = Captions()
        self.screens = DecodedScreens()
        self._live: frozenset[str] = frozenset()

    def receive_participant(self, message: motion_pb2.Participant) -> None:
        """The description of a participant, or that they have left."""
        if message.left:
            self._left.add(message.participant)
            self._voices.forget(message.participant)
            self._people.pop(message.participant, None)
            return
        self._left.discard(message.participant)
        about = described(message)
        if about.parcel in self._arrived:
            about = replace(about, here=True)
        person = self._people.get(about.name)
        if person is None:
            self._people[about.name] = _Person(about, self._delay, message.site)
        else:
            person.about, person.site = about, message.site

    @property
    def awaited(self) -> frozenset[str]:
        """Digests of avatars that somebody has and that are not here yet."""
        return frozenset(p.about.parcel for p in self._people.values() if not p.about.here)

    def avatar_arrived(self, digest: str) -> None:
        """An avatar is here."""
        self._arrived.add(digest)
        for person in list(self._people.values()):
            if person.about.parcel == digest:
                person.about = replace(person.about, here=True)

    def avatar_refused(self, site: str, digest: str) -> None:
        """What `site` sent as an avatar is none: its people need not wait for it."""
        for person in list(self._people.values()):
            if person.about.parcel == digest and person.site == site:
                person.about = replace(person.about, here=True)

    @property
    def looks(self) -> frozenset[str]:
        """Digests of the polymeshes that things of the room look like."""
        return self._looks

    @property
    def pages(self) -> frozenset[str]:
        """Digests of the polymeshes that panels show, and of those that they show when somebody turns a page."""
        return self._pages

    @property
    def live(self) -> frozenset[str]:
        """Participants whose screen a panel shows while it comes."""
        return self._live

    def receive_screen(self, name: str, message: motion_pb2.ScreenPart, received_ns: int) -> None:
        """A part of what a participant shows live; decoded where a panel shows it."""
        if name in self._live:
            self.screens.receive(name, message, received_ns)

    def receive_motion(self, name: str, message: motion_pb2.Motion, received_ns: int, *, thin: bool = False) -> None:
        """The motion of a participant, in full or thin: the newer posture is shown. Before their description is received, they are
        shown under the name in the bus key."""
        if name in self._left:
            return  # it was on its way when they left
        person = self._people.get(name)
        if person is None:
            person = self._people[name] = _Person(ParticipantInfo(name, name), self._delay)
        for t_ns, received in (person.thin_reader if thin else person.reader).read(message):
            person.playout.push(t_ns, received, received_ns)

    def receive_world(self, now: RoomState, received_ns: int) -> None:
        """A step of the room."""
        if now.things is not self._described:
            self._describe(now.things)
        if now.touches is not self._touches or now.things is not self._described:
            self._touches, self._ghosts = now.touches, ghosts_from(now.touches, now.things)
        self._described = now.things
        self._world.push(now.t_ns, view_of(now, self._ghosts), received_ns)

    def receive_voice(self, name: str, message: audio_pb2.Voice) -> None:
        """A participant's voice, or how loud it is: their mouth follows it where nothing else tells of their face."""
        self._voices.receive(name, message)

    def receive_sound_status(self, message: audio_pb2.SoundStatus) -> None:
        """The state of this site's voices: who is heard, and whose picture must wait because the voice comes later."""
        self._talking = frozenset(s.participant for s in message.streams if s.talking)
        for stream in message.streams:
            person = self._people.get(stream.participant)
            if person is not None and math.isfinite(stream.needed_s):
                wait_s = min(MOST_WAIT_S, stream.needed_s) if message.policy == "match" else 0.0
                person.playout.wait_for(round(wait_s * 1e9))

    def instant(self, now_ns: int) -> Instant:
        """What is shown at `now_ns`."""
        people: list[PersonNow] = []
        coming: list[ParticipantInfo] = []
        common, common_ns = self._together()
        for name, person in list(self._people.items()):
            if name in self._own and not self._touches_somebody(name, now_ns):
                shown = person.playout.newest(now_ns)
            else:
                shown = person.playout.sample(now_ns, common_ns if name in common else None)
            timing = person.playout.timing
            if shown is None or timing is None:
                coming.append(person.about)
                continue
            if timing.age_ns > GONE_NS:
                log.info("event=participant_gone participant=%s silent_s=%.0f", name, timing.age_ns * 1e-9)
                del self._people[name]
                self._voices.forget(name)
                continue
            posture = blinking(shown.posture, name, now_ns - timing.delay_ns)
            people.append(PersonNow(person.about, posture, timing))
        world = self._world.sample(now_ns, common_ns) or PlayoutWorld()
        captions = self.captions.shown(now_ns, {name: p.about.display_name for name, p in self._people.items()})
        shown = self._in_hands(now_ns, people, world)
        heard = {p.about.name: self._voices.at(p.about.name, now_ns - p.timing.delay_ns) for p in people}
        speech = {name: s for name, s in heard.items() if s is not None}
        screens = self.screens.shown(now_ns)
        return Instant(now_ns, *shown, self._things, tuple(coming), self._talking, captions, speech, screens)

    def _touches_somebody(self, name: str, now_ns: int) -> bool:
        """Whether they touch, or are touched by, another person, or did lately: both have to be shown at the same moment."""
        if any(name in (g.source, g.target) and {g.source, g.target} <= self._people.keys() for g in self._ghosts):
            self._touched_ns[name] = now_ns
        return now_ns - self._touched_ns.get(name, -TOUCHED_NS) < TOUCHED_NS

    def _together(self) -> tuple[frozenset[str], int | None]:
        """Who needs nearly the delay of the room, and the one that they have in common with it: what the latest of them wants."""
        room = self._world
        if room.needed_ns is None or room.wanted_ns is None or not isinstance(self._delay, AdaptiveDelay):
            return frozenset(), None
        needed = {name: person.playout.needed_ns for name, person in self._people.items()}
        near = frozenset(name for name, n in needed.items() if n is not None and abs(n - room.needed_ns) <= TOGETHER_NS)
        return near, round(max([room.wanted_ns, *(self._people[name].playout.wanted_ns or 0.0 for name in near)]))

    def _in_hands(self, now_ns: int, people: list[PersonNow], world: PlayoutWorld) -> tuple[tuple[PersonNow, ...], PlayoutWorld]:
        """People with their fingers on what they hold, and the world with it in their hands."""
        holders = {g.participant for g in world.grasps}
        shown = {p.about.name: _shown(p) for p in people if p.about.name in holders}
        world = self._held.poses(now_ns, world, shown)
        postures = self._held.fingers(now_ns, world, {p.about.name: p.posture for p in people})
        return tuple(replace(p, posture=postures[p.about.name]) for p in people), world

    def _describe(self, described: Mapping[str, world_pb2.Thing]) -> None:
        things: dict[str, Thing] = {}
        for name, t in described.items():
            known = self._described.get(name)
            if name in self._things and (known is t or known == t):
                things[name] = self._things[name]
                continue
            try:
                things[name] = thing_of(t)
            except ValueError as e:
                log.error("event=bad_thing thing=%s reason=%r action=not_drawn", name, str(e))
        if things != dict(self._things):
            self._things = MappingProxyType(things)
            self._looks = frozenset(k.model for t in things.values() for k in t.looks)
            self._pages = frozenset(page for t in things.values() if t.pages for page in _needed(t.pages))
            self._live = frozenset(t.pages.by for t in things.values() if t.pages and t.pages.live)
            self.screens.keep_only(self._live)


def _needed(pages: Pages) -> tuple[str, ...]:
    """The page that is shown, the one before and the one after it."""
    return pages.models[max(0, pages.shown - 1) : pages.shown + 2]


def _shown(person: PersonNow) -> ShownPerson:
    """A person with their joints as they are shown."""
    limbs = person.about.proportions
    skeleton = standard_skeleton(person.about.height) if limbs is None else limbs.skeleton
    return ShownPerson(person.posture, pose_joints(skeleton, person.posture), skeleton)


def _limbs(message: motion_pb2.Participant) -> Proportions | None:
    if not message.HasField("proportions"):
        return None
    try:
        return Proportions.from_arrays(**from_message(message.proportions))
    except ValueError as e:
        log.error("event=bad_proportions participant=%s reason=%r shown=average", message.participant, str(e))
        return None

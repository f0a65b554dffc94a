"""The room as its viewers see it: what crosses the bus, played out as the sites' renderers do, and made one frame for all."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

import numpy as np

from vistel.audio.forwarded_voices import ForwardedVoices
from vistel.conference.model import Conference
from vistel.figure.face.arkit import coefficients
from vistel.figure.face.countenance import Countenance
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import Skeleton, standard_skeleton
from vistel.geometry.pose import Pose
from vistel.render.config import live_delay
from vistel.render.frames import header, joints_told, person_row, thing_rows
from vistel.render.pressed_things import PressedRoom
from vistel.render.room_gltf import FURNITURE
from vistel.render.stage.captions import caption_words
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow, Stage
from vistel.session.chat import Chat, Line, chat_words
from vistel.session.felt_forces import FeltForces
from vistel.session.models import RoomDeliveries
from vistel.session.room_words import held_words, signal_words
from vistel.session.screens import ForwardedScreens
from vistel.session.told_commands import ToldCommands
from vistel.session.written import WrittenWords, face_rows
from vistel.space.files.model import Polymesh
from vistel.space.things.things import Thing
from vistel.v1.audio_pb2 import SoundStatus
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.motion.interest import ChosenSubscriptions, MotionSubscriptions, nearest
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel_services.console.assets import Assets
from vistel_services.deliveries.avatars import Deliveries

_CHOOSE_NS = 500_000_000
"""From one choice of who of a crowd is received in full to the next."""
_WHOLE_NS = 500_000_000
"""From one frame with all things to the next; between them those that have moved since."""
_ON_S = 0.055
"""From the arrival of a voice to the page that plays it: it waits for the next frame here, and for its turn there."""
_MIDDLE = np.zeros(3)
"""Of the room: who sits near it is received in full."""


class Feed:
    """Lives on the event loop while somebody watches. Call `step` for each frame."""

    def __init__(self, conference: Conference, bus: Bus, clock: Clock, chat: Chat) -> None:
        self._conference, self._bus, self._clock, self._chat = conference, bus, clock, chat
        self.stage = Stage(live_delay(conference.playout))
        self._sites = {p.name: s.name for s in conference.sites for p in s.participants}
        self._about = bus.subscribe(BY_NAME["participant"], polled=True)
        self._utterances = bus.subscribe(BY_NAME["utterance"], polled=True)
        crowd = conference.crowd
        self._sound = bus.subscribe(BY_NAME["voice_level" if crowd else "voice"], queue_all=True, polled=True)
        self._near = ChosenSubscriptions(bus, BY_NAME["voice"], crowd)
        self._voices, self.screens = ForwardedVoices(), ForwardedScreens(bus)
        self._motion = MotionSubscriptions(bus, conference.crowd, ())
        self._world = WorldListener(bus, clock)
        self._avatars = Deliveries(bus, self.stage)
        self._models = dict[str, Polymesh]()
        self._furniture = RoomDeliveries(bus, clock, self._models)
        self._assets = Assets(conference, self._parcel, self._models, self._changed)
        self._commands = ToldCommands(bus)
        self._pressed, self._forces = PressedRoom(self._assets.pressed, self._assets.thing), FeltForces(bus, crowd=bool(crowd))
        self._faces: dict[str, Countenance] = {}
        self._table, self._stale, self._newcomers = 0, True, True
        self._listed: tuple[tuple[ParticipantInfo, ...], Mapping[str, Thing]] = ((), {})
        self._shown: tuple[str, ...] = ()
        self._whole_ns = self._chosen_ns = 0
        self._poses: Mapping[str, Pose] = {}
        self._words: dict[str, str] = {}
        self._lines: tuple[Line, ...] = ()
        self._written = WrittenWords()

    def voices(self, instant: Instant) -> list[tuple[str, bytes]]:
        """Who has spoken since the last call, and the packets, to be heard in time with the pictures of an instant."""
        delays = {p.about.name: p.timing.delay_ns for p in instant.people}
        return self._voices.records(lambda name: delays.get(name, 0))

    def step(self, now_ns: int, *, heard: bool = False) -> tuple[Instant, bytes, list[tuple[str, str]]]:
        """What is shown at `now_ns`, its frame, and what else has changed: kinds and JSON. heard: whether a viewer hears voices."""
        self._take()
        instant = self.stage.instant(now_ns)
        self._choose(instant, heard)
        messages = list(self._messages(instant))
        return instant, self._frame(instant), messages

    def look(self, now_ns: int) -> None:
        """Be where who sees `now_ns` is, and tell nothing."""
        self._take()
        self.stage.instant(now_ns)

    def tell_all(self) -> None:
        """Tell everything again with the next frame: somebody has come."""
        self._stale, self._newcomers, self._words, self._lines, self._whole_ns = True, True, {}, (), 0
        self._written.again()

    def begin_again(self) -> None:
        """Time has leapt: forget who is where. What has been made of figures and things stays."""
        for part in (self._about, self._motion, self._sound, self._utterances):
            part.take()
        self._avatars.close()
        self._world.close()
        self._chat.forget()
        self.stage, self._faces, self._voices = Stage(live_delay(self._conference.playout)), {}, ForwardedVoices()
        self._avatars, self._world = Deliveries(self._bus, self.stage), WorldListener(self._bus, self._clock)
        self._whole_ns = self._chosen_ns = 0
        self._world.take()
        self.screens.begin_again()
        self._forces.begin_again()

    def file(self, digest: str) -> bytes | None:
        """A GLB file of the room."""
        return self._assets.file(digest)

    def _parcel(self, digest: str) -> bytes:
        return self._avatars.parcel(digest)

    def close(self) -> None:
        """Receive no more."""
        for part in (self._about, self._utterances, self._sound, self._near, self._motion, self._world):
            part.close()
        for part in (self._avatars, self._furniture, self._assets, self.screens, self._forces, self._commands):
            part.close()

    def _take(self) -> None:
        stage = self.stage
        self._chat.take()
        for sample in self._about.take():
            stage.receive_participant(sample.message)
        self._avatars.take()
        self._furniture.want(stage.looks - stage.pages - self._assets.models_here)
        self._furniture.show(stage.pages)
        for sample in self._motion.take():
            stage.receive_motion(
                sample.names["participant"], sample.message, sample.received_ns, thin=sample.topic.name == "motion_thin"
            )
        for now, received_ns in self._world.take():
            stage.receive_world(now, received_ns)
        for sample in self._utterances.take():
            stage.captions.receive(sample.message, sample.received_ns)
        for sample in (*self._sound.take(), *self._near.take()):
            self._voices.receive(sample.names["participant"], sample.message, sample.received_ns)
            stage.receive_voice(sample.names["participant"], sample.message)

    def _choose(self, shown: Instant, heard: bool) -> None:
        if shown.now_ns - self._chosen_ns < _CHOOSE_NS:
            return
        self._chosen_ns = shown.now_ns
        places = {p.about.name: p.posture.stance.position for p in shown.people}
        near = nearest([_MIDDLE], places, self._motion.chosen)
        self._motion.choose(near)
        self._near.choose(near)
        # Where somebody hears them, pictures wait for their voices, as at the sites (`Stage.receive_sound_status`).
        needed = {name: t_ns * 1e-9 + _ON_S for name, t_ns in self._voices.needed_ns().items()} if heard else {}
        streams = [SoundStatus.Stream(participant=name, needed_s=wait_s) for name, wait_s in needed.items()]
        self.stage.receive_sound_status(SoundStatus(policy="match", streams=streams))

    def _changed(self) -> None:
        self._stale = True

    def _messages(self, now: Instant) -> Iterator[tuple[str, str]]:
        people = tuple(p.about for p in now.people)
        if self._newcomers:
            self._newcomers = False
            yield "joints", joints_told()
        if self._stale or people != self._listed[0] or now.things is not self._listed[1]:
            self._stale, self._listed = False, (people, now.things)
            self._table += 1
            self._whole_ns = 0
            yield "table", json.dumps({"kind": "table", "table": self._table & 0xFFFF} | self._rows(people, now.things))
        touching = sorted({(g.target, g.source) for g in now.world.ghosts})
        for kind, words in (
            ("held", held_words(now.world.grasps, touching)),
            ("signals", signal_words(now.world.signals)),
            ("captions", caption_words(now.captions)),
            ("answers", self._commands.words()),
            *self._pressed.words(now),
            ("forces", self._forces.words(now.now_ns, {p.about.name: p.timing.delay_ns for p in now.people})),
        ):
            if words != self._words.get(kind):
                self._words[kind] = words
                yield kind, words
        yield from self._written.words(now.world.strokes)
        if self._chat.lines != self._lines:
            self._lines = self._chat.lines
            yield "chat", chat_words(self._lines)

    def _rows(self, people: tuple[ParticipantInfo, ...], things: Mapping[str, Thing]) -> dict[str, object]:
        rows: list[dict[str, object]] = []
        for about in people:
            figure, skeleton = self._assets.figure(about), self._skeleton(about)
            row: dict[str, object] = {"name": about.name, "shown": about.display_name, "site": self._sites.get(about.name, "")}
            rows.append(row | {"rest": np.round(skeleton.offsets, 5).tolist(), "file": figure and figure.digest})
        self._shown = tuple(t.id for t in things.values() if not t.hidden and t.shape not in FURNITURE)
        of_things = [
            {"id": t.id, "name": t.name or t.id, "shape": t.shape, "mass_kg": round(t.mass, 3)}
            | {"file": (made := self._assets.thing(t)) and made.digest}
            | face_rows(t)
            for t in (things[name] for name in self._shown)
        ]
        self._assets.forget_but(people, things)
        return {"people": rows, "things": of_things, "room": (room := self._assets.room()) and room.digest}

    def _skeleton(self, about: ParticipantInfo) -> Skeleton:
        figure = self._assets.figure(about)
        if figure is not None:
            return figure.skeleton
        return standard_skeleton(about.height) if about.proportions is None else about.proportions.skeleton

    def _frame(self, now: Instant) -> bytes:
        people = [self._person(number, person, now) for number, person in enumerate(now.people)]
        whole = now.now_ns - self._whole_ns >= _WHOLE_NS
        here = [(number, now.world.poses[t]) for number, t in enumerate(self._shown) if t in now.world.poses]
        moved = here if whole else [(n, pose) for n, pose in here if not _same(pose, self._poses.get(self._shown[n]))]
        if whole:
            self._whole_ns, self._poses = now.now_ns, now.world.poses
        things = thing_rows((n, pose.position, pose.rotation) for n, pose in moved)
        return b"".join((header(self._table, len(people), len(moved), now.now_ns * 1e-6), *people, things.tobytes()))

    def _person(self, number: int, person: PersonNow, now: Instant) -> bytes:
        name, speech = person.about.name, now.speech.get(person.about.name)
        if name not in self._faces:
            self._faces[name] = Countenance()
        state = self._faces[name].step(person.posture, now.now_ns - person.timing.delay_ns, speech)
        joints = pose_joints(self._skeleton(person.about), person.posture)
        return person_row(number, joints, coefficients(state.expression), talks=speech is not None).tobytes()


def _same(pose: Pose, before: Pose | None) -> bool:
    return before is not None and np.array_equal(pose.position, before.position) and np.array_equal(pose.rotation, before.rotation)

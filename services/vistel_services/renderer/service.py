"""The renderer as a service: receives motion and world, draws at its rate, writes the site's video."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from types import MappingProxyType

from prometheus_client import Counter, Gauge, Histogram

from vistel.conference.model import Conference, Site
from vistel.conference.paths import RunPaths
from vistel.render.config import RenderConfig, render_config
from vistel.render.interaction.requests import CommandRequest, Drag, Drop, RecordRequest, Request
from vistel.render.stage.stage import Instant, Stage
from vistel.render.view.screens import boxes
from vistel.render.view.view import View
from vistel.session.models import RoomDeliveries
from vistel.space.files.model import Polymesh
from vistel.v1 import audio_pb2, service_pb2
from vistel.wire import motion
from vistel.wire.bus import Bus, Publication
from vistel.wire.clock import Clock
from vistel.wire.motion.interest import MotionSubscriptions, nearest
from vistel.wire.shared_pictures import shared_path
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel_services.deliveries.avatars import Deliveries
from vistel_services.process.clocks import begin_ns_of
from vistel_services.renderer.drawing_thread import DrawingThread
from vistel_services.renderer.figure_maker import load_apart
from vistel_services.renderer.first_picture import FirstPicture
from vistel_services.renderer.out.outputs import Out, Outputs
from vistel_services.renderer.window.space_mouse import SpaceMouse
from vistel_services.renderer.window.window import Pane
from vistel_services.renderer.window.wire import WindowWire
from vistel_services.serving.address import stream_address

log = logging.getLogger("vistel.renderer")

_FRAMES = Counter("vistel_renderer_frames_total", "Pictures drawn", ["site"])
_FRAME_TIME = Histogram(
    "vistel_renderer_frame_time_seconds",
    "Drawing one picture",
    ["site"],
    buckets=(0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12, 0.25, 0.5, 1.0),
)
_RATE = Gauge("vistel_renderer_rate_hertz", "Pictures per second since the last report", ["site"])
_AGE = Gauge("vistel_renderer_motion_age_seconds", "Age of the newest motion when drawn", ["site", "participant"])

_REPORT_NS = 500_000_000
_TURN_REPORT_NS = 100_000_000
"""From one report to the next while delays change: voices know the way of a picture's delay only until it turns."""
_TURN_NS = 4_000_000
"""A delay that will become longer or shorter by more than this than was reported has turned."""
_CHOOSE_NS = 500_000_000


@dataclass(frozen=True)
class Config:
    """site: its name; drawn: what its pictures show; rate: pictures per second at most; out: where pictures go beside windows;
    panes: the windows; people: the site's participants, whose details of the room are listened to; whole: every pixel is drawn,
    however long it takes; sites: of the conference, and who is at each."""

    site: str
    drawn: RenderConfig
    rate: float
    out: Out = field(default_factory=Out)
    panes: tuple[Pane, ...] = ()
    people: tuple[str, ...] = ()
    whole: bool = False
    sites: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: MappingProxyType({}))
    crowd: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """See `Conference.crowd`."""


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> Config:
    """The renderer of `site`."""
    if site is None:
        raise ValueError("renderer: runs at a site, but none is given")
    shown, drawn = site.display, render_config(conference, site)
    out = Out(
        paths.video(site.name) if shown.video else None,
        stream_address(shown),
        bool(site.audio and site.audio.stream),
        paths.video(site.name),
        shared_path(conference.name, site.name) if shown.shared_memory else None,
        shown.virtual_camera,
    )
    return Config(
        site.name,
        drawn,
        shown.frames_per_s,
        out,
        _panes(site, drawn.view),
        tuple(p.name for p in site.participants),
        shown.resolution == "full",
        {s.name: tuple(p.name for p in s.participants) for s in conference.sites},
        conference.crowd,
    )


def _panes(site: Site, view: View) -> tuple[Pane, ...]:
    """The windows of a site."""
    title = f"VISTEL {site.name}"
    if site.display.window == "each":
        parts = zip(site.display.screens, boxes(view.screens, view.stereo), strict=True)
        return tuple(Pane(f"{title} {s.name}", s.width, s.height, s.monitor, s.at, box) for s, box in parts)
    return (Pane(title, view.width // view.stereo.widths, view.height),) if site.display.window else ()


class Reporter:
    """Publishes how late this site's pictures are: twice a second, sooner when a delay turns, and at once, in the log as well,
    when the first one is there, somebody more or less is in it, or somebody is no stand-in any more."""

    def __init__(self, site: str, publication: Publication) -> None:
        self._site, self._publication = site, publication
        self._frames = 0
        self._since_ns: int | None = None
        self._since_frames = 0
        self._spent_ns = 0
        self._shown: tuple[int, int] | None = None
        self._towards: dict[str, int] = {}

    def drawn(self, instant: Instant, done_ns: int, stand_ins: int) -> None:
        """A picture of `instant` was ready at `done_ns`; `stand_ins` figures in it were not their own yet."""
        took = done_ns - instant.now_ns
        self._frames += 1
        self._spent_ns += took
        _FRAMES.labels(self._site).inc()
        _FRAME_TIME.labels(self._site).observe(took * 1e-9)
        since_ns = done_ns if self._since_ns is None else self._since_ns
        shown = len(instant.people), stand_ins
        towards = {p.about.name: p.timing.towards_ns for p in instant.people}
        turned = any(abs(ns - self._towards.get(name, ns)) > _TURN_NS for name, ns in towards.items())
        if shown == self._shown and done_ns - since_ns < (_TURN_REPORT_NS if turned else _REPORT_NS):
            return
        self._towards = towards
        if shown != self._shown:
            log.info("event=picture people=%d stand_ins=%d took_ms=%.0f", *shown, took * 1e-6)
        self._shown = shown
        count = self._frames - self._since_frames
        rate = 0.0 if done_ns == since_ns else count / ((done_ns - since_ns) * 1e-9)
        message = service_pb2.ImageDelay(
            site=self._site,
            stand_ins=stand_ins,
            frames=self._frames,
            frames_per_s=rate,
            frame_time_s=self._spent_ns * 1e-9 / max(1, count),
        )
        message.header.t_ns = done_ns
        # Drawing takes now longer, now shorter; voices follow what it takes on average.
        drawing_ns = self._spent_ns / max(1, count)
        for person in instant.people:
            t = person.timing
            message.streams.add(
                participant=person.about.name,
                delay_s=(t.delay_ns + drawing_ns) * 1e-9,
                age_s=t.age_ns * 1e-9,
                jitter_s=t.jitter_ns * 1e-9,
                shown_ns=max(0, instant.now_ns - t.delay_ns),
                playout_s=t.playout_ns * 1e-9,
                towards_s=t.towards_ns * 1e-9,
                rate=t.rate,
            )
            _AGE.labels(self._site, person.about.name).set(t.age_ns * 1e-9)
        self._publication.put(message)
        _RATE.labels(self._site).set(rate)
        self._since_ns, self._since_frames, self._spent_ns = done_ns, self._frames, 0


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """Draw until cancelled."""
    first = FirstPicture(config.site)
    await asyncio.to_thread(motion.warm_up)
    drawn, view = config.drawn, config.drawn.view
    thread = ThreadPoolExecutor(1, thread_name_prefix="gl")
    stage = Stage(round(drawn.delay_s * 1e9) if drawn.live_delay is None else drawn.live_delay, drawn.own)
    models: dict[str, Polymesh] = {}
    furniture = RoomDeliveries(bus, clock, models)
    deliveries = Deliveries(bus, stage)
    inputs = _Inputs(bus, stage, clock, config.site, config.people, config.crowd)
    newest = _Newest(stage, clock)
    reporter = Reporter(config.site, bus.publish(BY_NAME["image_delay"], site=config.site))
    outputs = Outputs(config.site, config.out)
    load = partial(load_apart, files=drawn.avatars, parcel=deliveries.parcel)
    drawing = DrawingThread(
        config.site, view, config.rate, drawn.seats, drawn.room, config.whole, load, thread, models, config.panes
    )
    wire = WindowWire(bus, clock, view.eyes, config.sites) if config.panes else None
    mouse = SpaceMouse(clock) if config.panes else None
    period_ns = round(1e9 / config.rate)
    somebody = False
    try:
        await outputs.open((view.width, view.height), config.rate, clock)
        first.done("opening")
        due_ns = clock.now_ns()
        while True:
            await drawing.take_turn(clock)
            inputs.take()
            deliveries.take()
            if drawing.furnished:
                furniture.want(stage.looks - stage.pages)
                furniture.show(stage.pages)
            for sound in inputs.sounds():
                outputs.put_sound(sound.header.t_ns, sound.opus)
            if wire is not None and mouse is not None:
                wire.take()
                mouse.look()
                drawing.deflection = mouse.deflection
                drawing.status = wire.status.now(clock.now_ns(), outputs.film)
            furnished = drawing.furnished
            picture = await drawing.draw(newest)
            instant = newest.instant
            inputs.choose(instant)
            if drawing.furnished and not furnished and not first.logged:
                first.done("setting_up")
            if wire is not None:
                _carry_out(drawing.requests(), wire, outputs, instant.now_ns)
            if picture is not None:
                done_ns = clock.now_ns()
                first.shown(len(instant.people), drawing.stand_ins)
                reporter.drawn(instant, done_ns, drawing.stand_ins)
                somebody = somebody or (bool(instant.people) and instant.now_ns >= begin_ns_of(clock))
                late_ns = done_ns - instant.now_ns + max((p.timing.delay_ns for p in instant.people), default=0)
                outputs.put(done_ns, picture, late_ns, somebody)
            due_ns = max(due_ns + period_ns, clock.now_ns() - period_ns // 4)
            await clock.sleep_until_ns(due_ns)
    finally:
        inputs.close()
        deliveries.close()
        furniture.close()
        if wire is not None and mouse is not None:
            wire.close()
            mouse.close()
        await asyncio.shield(_wind_up(drawing, outputs, thread))


def _carry_out(requests: Sequence[Request], wire: WindowWire, outputs: Outputs, now_ns: int) -> None:
    """What somebody at the window wants that is not the picture's business."""
    for request in requests:
        if isinstance(request, CommandRequest):
            wire.ask(request)
        elif isinstance(request, Drag):
            wire.drag(request)
        elif isinstance(request, Drop):
            wire.drop(request)
        elif isinstance(request, RecordRequest):
            fault = outputs.record(request.on)
            if fault:
                wire.status.notice(fault, now_ns, warning=True)


async def _wind_up(drawing: DrawingThread, outputs: Outputs, thread: ThreadPoolExecutor) -> None:
    await drawing.close()
    await outputs.close()
    thread.shutdown(wait=False)


class _Newest:
    """What is shown at the moment of the call."""

    def __init__(self, stage: Stage, clock: Clock) -> None:
        self._stage, self._clock = stage, clock
        self.instant = Instant(0)

    def __call__(self) -> Instant:
        self.instant = self._stage.instant(self._clock.now_ns())
        return self.instant


class _Inputs:
    """The subscriptions of the stage."""

    def __init__(self, bus: Bus, stage: Stage, clock: Clock, site: str, people: Sequence[str], crowd: Mapping[str, str]) -> None:
        self._stage = stage
        self._people, self._chosen_ns = frozenset(people), 0
        self._status = bus.subscribe(BY_NAME["sound_status"], polled=True, site=site)
        self._sound = bus.subscribe(BY_NAME["sound"], queue_all=True, polled=True, site=site)
        self._about = bus.subscribe(BY_NAME["participant"], polled=True)
        self._voices = bus.subscribe(BY_NAME["voice_level" if crowd else "voice"], queue_all=True, polled=True)
        self._said = bus.subscribe(BY_NAME["utterance"], polled=True)
        self._written = bus.subscribe(BY_NAME["chat"], polled=True)
        self._shown = bus.subscribe(BY_NAME["screen"], queue_all=True, polled=True)
        self._motion = MotionSubscriptions(bus, crowd, people)
        self._world = WorldListener(bus, clock, people)

    def take(self) -> None:
        """Hand everything that has arrived to the stage."""
        for sample in self._about.take():
            self._stage.receive_participant(sample.message)
        for sample in self._motion.take():
            thin = sample.topic.name == "motion_thin"
            self._stage.receive_motion(sample.names["participant"], sample.message, sample.received_ns, thin=thin)
        for now, received_ns in self._world.take():
            self._stage.receive_world(now, received_ns)
        for sample in self._status.take():
            self._stage.receive_sound_status(sample.message)
        for sample in self._voices.take():
            self._stage.receive_voice(sample.names["participant"], sample.message)
        for sample in self._said.take():
            self._stage.captions.receive(sample.message, sample.received_ns)
        for sample in self._written.take():
            self._stage.captions.receive_line(sample.names["participant"], sample.message, sample.received_ns)
        for sample in self._shown.take():
            self._stage.receive_screen(sample.names["participant"], sample.message, sample.received_ns)

    def choose(self, shown: Instant) -> None:
        """In a crowd, receive in full who is near the site's people, and who is heard."""
        if shown.now_ns - self._chosen_ns < _CHOOSE_NS:
            return
        self._chosen_ns = shown.now_ns
        places = {p.about.name: p.posture.stance.position for p in shown.people}
        others = {name: place for name, place in places.items() if name not in self._people}
        here = [place for name, place in places.items() if name in self._people]
        self._motion.choose(nearest(here, others, self._motion.chosen) | shown.talking)

    def sounds(self) -> list[audio_pb2.Sound]:
        """The sound that was played here since the last call."""
        return [sample.message for sample in self._sound.take()]

    def close(self) -> None:
        told = self._about, self._voices, self._said, self._written, self._shown
        for subscription in (*told, self._motion, self._world, self._status, self._sound):
            subscription.close()

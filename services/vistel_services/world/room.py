"""One room: its world, what it receives and what it publishes."""

from __future__ import annotations

import contextlib
import logging
import time
from collections import deque
from collections.abc import Collection, Mapping, Sequence

from google.protobuf.message import DecodeError
from prometheus_client import Counter, Gauge, Histogram

from vistel.host import HOST
from vistel.messages.world.decode import command_input, prop_input
from vistel.messages.world.encode import bond_torn, button_event, carries_state, command_result, hand_force, input_person, ownership
from vistel.messages.world.encoder import WorldEncoder
from vistel.persistence import journal
from vistel.persistence.store import Store
from vistel.space.hands.claims import ClaimEvent
from vistel.space.inputs import StepInputs
from vistel.space.view import HandForce, Outcome, WorldView
from vistel.space.world import World
from vistel.v1.command_pb2 import Command
from vistel.v1.world_pb2 import WorldInputs, WorldSnapshot, WorldSnapshotRequest
from vistel.wire.bus import Bus, Publication
from vistel.wire.clock import Clock, sleep, within
from vistel.wire.motion.interest import MotionSubscriptions
from vistel.wire.topics import BY_NAME
from vistel_services.world.received import InputCollector, ReceivedInputs

log = logging.getLogger("vistel.world")

STEP_NS = 16_666_667
SAVE_STEPS = 120
"""Steps from one snapshot to the next: two seconds."""
FOLLOW_S = 1.5
"""How long a world that takes a room over waits, at most, until it can decode everybody's motion."""
LISTEN_S = 0.02
"""How often it looks meanwhile."""
IDLE_S = 1.0
"""How often a world that waits empties its subscriptions."""
RECENT = 5
"""Looks whose messages are kept for the first step."""
TOPICS = "participant", "prop", "command"
"""The inputs of a room beside motion."""
REACH_STEPS = 12
"""Steps from one look at who reaches for something to the next."""

_STEPS = Counter("vistel_world_steps_total", "Steps done")
_STEP_TIME = Histogram(
    "vistel_world_step_time_seconds",
    "Computing one step",
    buckets=(0.0005, 0.001, 0.002, 0.003, 0.004, 0.006, 0.008, 0.012, 0.016, 0.03, 0.1),
)
_PEOPLE = Gauge("vistel_world_participants_count", "People in the room")
_COMMANDS = Counter("vistel_world_commands_total", "Commands answered", ["outcome"])


class RoomSubscriptions:
    """The subscriptions of a room. They begin before there is a world, so that nothing is missed when one takes a room over."""

    def __init__(self, bus: Bus, crowd: Mapping[str, str]) -> None:
        """crowd: participants and their sites, empty: all motion is received in full."""
        self._motion = MotionSubscriptions(bus, crowd, ())
        self._inboxes = [bus.subscribe(BY_NAME[name], queue_all=True, polled=True) for name in TOPICS]
        self._inputs = bus.subscribe(BY_NAME["world_inputs"], polled=True)
        self.newest_state = b""
        """The newest state that another world has published: where to go on by force, if all else is lost."""
        self.collector = InputCollector()
        self._recent: deque[ReceivedInputs] = deque(maxlen=RECENT)

    async def follow_motion(self, people: Sequence[str], clock: Clock) -> None:
        """Receive while another world leads, until the motions of all `people` can be decoded, or for FOLLOW_S."""
        with contextlib.suppress(TimeoutError):
            async with within(clock, FOLLOW_S):
                while not self.collector.follows(people):
                    await sleep(clock, LISTEN_S)
                    self._look(clock)

    async def listen(self, clock: Clock) -> None:
        """Empty the subscriptions until cancelled."""
        while True:
            await sleep(clock, IDLE_S)
            self._look(clock)
            for sample in self._inputs.take():
                self.newest_state = sample.message.private_state or self.newest_state

    def _look(self, clock: Clock) -> None:
        self.take()
        self._recent.append(self.collector.take(clock.now_ns()))

    def adopt(self, world: World, now_ns: int) -> None:
        """From now on all that arrives is for `world`."""
        self._inputs.close()
        self.collector.adopt(world.heard, self._recent, now_ns)
        self._recent.clear()

    def take(self) -> None:
        """Everything that has arrived, for the next step."""
        i = self.collector
        for inbox, take in zip((*self._inboxes, self._motion), (i.participant, i.prop, i.command, i.motion), strict=True):
            for sample in inbox.take():
                take(sample)

    def follow(self, reaching: Collection[str]) -> None:
        """In a crowd, receive in full the motion of those who may touch something soon; that of the others comes thin."""
        self._motion.choose(reaching)

    def close(self) -> None:
        """End the subscriptions."""
        for inbox in (self._motion, *self._inboxes, self._inputs):
            inbox.close()


class Room:
    """Steps a world and publishes it."""

    def __init__(
        self, world: World, bus: Bus, subscriptions: RoomSubscriptions, store: Store | None, now_ns: int, hosts: frozenset[str]
    ) -> None:
        """hosts: who alone may put the room back; empty: everybody."""
        self.world = world
        self._hosts = hosts
        self._subscriptions = subscriptions
        self._store = store
        subscriptions.adopt(world, now_ns)
        self._bus = bus
        self._states, self._wholes = bus.publish(BY_NAME["world_state"]), bus.publish(BY_NAME["world_key"])
        self._encoder = WorldEncoder()
        self._inputs = bus.publish(BY_NAME["world_inputs"])
        self._results: dict[str, Publication] = {}
        self._outcomes: deque[tuple[Outcome, int]] = deque()
        self._torn = bus.publish(BY_NAME["bond_torn"])
        self._buttons = bus.publish(BY_NAME["button"])
        self._claims: dict[str, Publication] = {}
        self._forces: dict[tuple[str, bool], Publication] = {}
        self._details: dict[str, Publication] = {}
        self._begins = True
        self._last_ns = world.t_ns or now_ns
        self._held: dict[str, tuple[str, ...]] = {}

    def step(self, t_ns: int) -> None:
        """One step, about conference time `t_ns`. Its inputs are in the journal before it is published."""
        started = time.perf_counter()
        self._subscriptions.take()
        passed = max(1, round((t_ns - self._last_ns) / STEP_NS))
        number = self.world.step_number + passed
        arrived = self._subscriptions.collector.take(t_ns)
        only = f"only a host may put the room back: {', '.join(sorted(self._hosts))}"
        refused = [(who, c.id, only) for who, c in arrived.commands if not self._may(who, c)]
        # What was asked of an earlier world, and done then, comes again as the last message of its sender.
        refused += [(who, c.id, reason) for who, c, reason in arrived.late if not self.world.answered(who, c.id)]
        arrived.commands = [c for c in arrived.commands if self._may(*c)]
        before = self.world.snapshot() if carries_state(number, self._begins) else b""
        inputs = StepInputs(
            number,
            t_ns,
            tuple(arrived.people),
            tuple(arrived.motions),
            tuple(arrived.left),
            tuple(command_input(who, message) for who, message in arrived.commands),
            tuple(prop_input(message) for message in arrived.props),
        )
        view = self.world.step(inputs)
        if number % REACH_STEPS < passed:
            self._subscriptions.follow(self.world.reaching)
        message = inputs_message(inputs, arrived)
        if self._store is not None:
            self._store.append(journal.record(message, inputs))
        message.private_state = before
        self._inputs.put(message)
        self._publish(view)
        for felt in view.hands:
            self._publish_force(felt, view)
        for outcome in (*(Outcome(name, who, False, reason, number) for who, name, reason in refused), *view.outcomes):
            self._outcomes.append((outcome, t_ns))
        for event in view.claims:
            self._publish_owner(event, view)
        for torn in view.torn:
            log.info("bond torn thing=%s body=%s force_n=%.2f gap_mm=%.1f", torn.thing, torn.body, torn.force, 1e3 * torn.gap)
            self._torn.put(bond_torn(torn, view.step, view.t_ns))
        for event in view.buttons:
            done = "pressed" if event.pressed else "released"
            log.info("event=button_%s joint=%s thing=%s participant=%s", done, event.joint, event.thing, event.participant)
            self._buttons.put(button_event(event, view.step, view.t_ns))
        self._log_grasps(view)
        self._begins, self._last_ns = False, t_ns
        _STEPS.inc()
        _PEOPLE.set(len(view.participants))
        _STEP_TIME.observe(time.perf_counter() - started)

    @property
    def unanswered(self) -> int:
        """How many commands were done or refused and not answered: their steps may not be on the disk yet."""
        return len(self._outcomes)

    def answer_commands(self, count: int) -> None:
        """Answer the first of them."""
        for _ in range(min(count, len(self._outcomes))):
            self._answer(*self._outcomes.popleft())

    def _may(self, who: str, command: Command) -> bool:
        return not self._hosts or who in {*self._hosts, HOST} or command.WhichOneof("action") != "reset"

    def answer(self, request: bytes) -> WorldSnapshot:
        """The whole room, for a late joiner."""
        out = WorldSnapshot(state=self._encoder.snapshot(words=not _state_only(request)))
        out.header.t_ns = self._last_ns
        return out

    def saved(self) -> WorldSnapshot:
        """The whole room with all that a world is made from, for who may keep it."""
        out = WorldSnapshot(state=self._encoder.snapshot(words=True), private_state=self.world.snapshot())
        out.header.t_ns = self._last_ns
        return out

    def _publish(self, view: WorldView) -> None:
        encoded = self._encoder.encode(view)
        if encoded.whole is not None:
            self._wholes.put(encoded.whole)
        if encoded.state is not None:
            for who, detail in self._encoder.details(self.world.eyes, view.t_ns).items():
                if who not in self._details:
                    self._details[who] = self._bus.publish(BY_NAME["world_detail"], participant=who)
                self._details[who].put(detail)
            self._states.put(encoded.state)

    def _answer(self, outcome: Outcome, t_ns: int) -> None:
        who, became = outcome.participant, "done" if outcome.done else "refused"
        _COMMANDS.labels(became).inc()
        log.info("command id=%s participant=%s outcome=%s reason=%r", outcome.id, who, became, outcome.reason)
        if who not in self._results:
            self._results[who] = self._bus.publish(BY_NAME["command_result"], participant=who)
        self._results[who].put(command_result(outcome, t_ns))

    def _publish_owner(self, event: ClaimEvent, view: WorldView) -> None:
        who = event.participant
        log.info("claim %s participant=%s thing=%s owner=%s", event.change.value, who, event.thing, event.owner or "nobody")
        if who not in self._claims:
            self._claims[who] = self._bus.publish(BY_NAME["ownership"], participant=who)
        self._claims[who].put(ownership(event, view.step, view.t_ns))

    def _publish_force(self, felt: HandForce, view: WorldView) -> None:
        hand = felt.participant, felt.right
        if hand not in self._forces:
            side = "right" if felt.right else "left"
            self._forces[hand] = self._bus.publish(BY_NAME["hand_force"], participant=felt.participant, hand=side)
        self._forces[hand].put(hand_force(felt, view.step, view.t_ns))

    def _log_grasps(self, view: WorldView) -> None:
        held = {s.id: s.holders for s in view.states if s.holders}
        for thing in sorted(held.keys() | self._held.keys()):
            if held.get(thing) != self._held.get(thing):
                log.info("thing=%s held_by=%s", thing, ",".join(held.get(thing, ())) or "nobody")
        self._held = held


def _state_only(request: bytes) -> bool:
    try:
        return WorldSnapshotRequest.FromString(request).state_only
    except DecodeError:
        return False


def inputs_message(inputs: StepInputs, arrived: ReceivedInputs | None = None) -> WorldInputs:
    """The inputs of a step as the message that is published. arrived: the messages they came in."""
    arrived = arrived if arrived is not None else ReceivedInputs()
    out = WorldInputs(step=inputs.step)
    out.header.t_ns = inputs.t_ns
    for m in inputs.motions:
        out.motions.add(participant=m.participant, motion_seq=m.seq, epoch=m.t_ns)
    for name in inputs.left:
        out.motions.add(participant=name, left=True)
    out.people.extend(input_person(p) for p in inputs.people)
    out.props.extend(arrived.props)
    for who, message in arrived.commands:
        kept = out.commands.add()
        kept.CopyFrom(message)
        # The key says who asks; a message that says otherwise stays refused when it is re-run.
        if message.participant not in ("", who):
            kept.ClearField("action")
        kept.participant = who
        out.command_ids.append(message.id)
    return out

"""Re-runs the world on a log and compares every recorded state, bit for bit.

A re-run begins wherever the log's `WorldInputs` carry the state before a step: once a second, and at each start of a
world. So a log may begin in the middle, the world may have been killed and started again, and after a gap in the
log the comparison goes on a second later; what could not be compared is counted and reported.
"""

import contextlib
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from vistel.messages.world.decode import command_input, motion_input, people_of, prop_input
from vistel.messages.world.encode import hand_force
from vistel.messages.world.encoder import WorldEncoder
from vistel.space.inputs import MotionInput, StepInputs
from vistel.space.view import WorldView
from vistel.space.world import World
from vistel.v1.world_pb2 import HandForce, WorldDetail, WorldInputs, WorldState
from vistel.wire.motion import MotionDecoder
from vistel.wire.world.codec.bits import FrameError

_Message = WorldState | HandForce | WorldDetail
Record = tuple[str, dict[str, str], Any, int]
"""Topic name, names in the key, message, log time [ns]."""

MOTION = ("motion", "motion_thin")
"""Topics of postures; a step may have used either."""
TOLD = ("world_state", "world_key")
"""Topics that a step publishes, in the order of `EncodedStep`."""
SETTLE_NS = 1_000_000_000
"""A recorder may write a motion later than the step that used it, by no more than this."""
MOTIONS_KEPT_NS = 20_000_000_000


@dataclass(frozen=True)
class VerifyReport:
    """steps: states re-run and compared; hand_forces: the same of what hands felt; equal: every one was the same;
    difference: the first that was not, or why nothing could be compared (one line, else empty); skipped: steps that
    could not be re-run, and why; lives: how often a world started in the log."""

    steps: int
    equal: bool
    difference: str = ""
    hand_forces: int = 0
    skipped: int = 0
    skipped_because: dict[str, int] = field(default_factory=dict[str, int])
    lives: int = 0


def verify(records: Iterable[Record]) -> VerifyReport:
    """Compare every WorldState of a log with a re-run. `records` in the order of the log; only the topics motion,
    world_inputs, world_state, world_key, world_detail and hand_force matter."""
    run = _Rerun()
    for topic, names, message, log_ns in records:
        run.take(topic, names, message, log_ns)
        if run.difference:
            break
    run.finish()
    difference = run.difference
    if not difference and run.steps == 0:
        difference = "the log holds no world states that can be re-run; record world_inputs, world_state and motion"
    return VerifyReport(run.steps, not difference, difference, run.hand_forces, sum(run.skipped.values()), run.skipped, run.lives)


class _Rerun:
    def __init__(self) -> None:
        self.steps, self.hand_forces = 0, 0
        self.lives = 0
        self.difference = ""
        self.skipped: dict[str, int] = {}
        self._world: World | None = None
        self._last_seq = 0
        self._decoders: dict[tuple[str, str, str], MotionDecoder] = {}
        self._motions: dict[tuple[str, int, int], MotionInput] = {}
        self._states: dict[tuple[str, int, int], WorldState] = {}
        self._encoder = WorldEncoder()
        self._forces: dict[tuple[int, int], list[HandForce]] = {}
        self._details: dict[tuple[int, int], dict[str, WorldDetail]] = {}
        self._pending: deque[tuple[WorldInputs, int]] = deque()

    def take(self, topic: str, names: dict[str, str], message: Any, log_ns: int) -> None:
        """One record of the log."""
        if topic in MOTION:
            self._hear(topic, names["site"], names["participant"], message)
        elif topic in TOLD:
            self._states[topic, message.step, message.header.t_ns] = message
        elif topic == "hand_force":
            self._forces.setdefault((message.step, message.header.t_ns), []).append(message)
        elif topic == "world_detail":
            self._details.setdefault((message.step, message.header.t_ns), {})[names["participant"]] = message
        elif topic == "world_inputs":
            self._pending.append((message, log_ns))
        while self._pending and not self.difference and log_ns - self._pending[0][1] > SETTLE_NS:
            self._step(self._pending.popleft()[0])

    def finish(self) -> None:
        """The log has ended."""
        while self._pending and not self.difference:
            self._step(self._pending.popleft()[0])

    def _hear(self, topic: str, site: str, participant: str, message: Any) -> None:
        decoded = self._decoders.setdefault((topic, site, participant), MotionDecoder()).decode(message)
        if decoded is None:
            return
        self._motions[participant, decoded.seq, decoded.t_ns] = motion_input(participant, decoded)
        oldest = next(iter(self._motions.values()))
        while decoded.t_ns - oldest.t_ns > MOTIONS_KEPT_NS:
            del self._motions[oldest.participant, oldest.seq, oldest.t_ns]
            oldest = next(iter(self._motions.values()))

    def _step(self, message: WorldInputs) -> None:
        recorded = [self._states.pop((topic, message.step, message.header.t_ns), None) for topic in TOLD]
        forces = self._forces.pop((message.step, message.header.t_ns), [])
        details = self._details.pop((message.step, message.header.t_ns), {})
        begins = message.header.seq == 1
        if begins or (self._world is not None and message.header.seq != self._last_seq + 1):
            self._world = None  # a new start, or a gap: go on from the next state in the log
        self._last_seq = message.header.seq
        self.lives += begins
        if message.private_state and not self._begin(message, begins):
            return
        if self._world is None:
            self._skip("before the first state in the log, or after a gap")
            return
        try:
            inputs = self._inputs(message)
        except ValueError as e:  # of an impossible body
            self._world = None
            self._skip(str(e))
            return
        if inputs is None:
            self._world = None
            self._skip("a motion the world used is not in the log")
            return
        view = self._world.step(inputs)
        again = {(h.participant, h.right): hand_force(h, view.step, view.t_ns) for h in view.hands}
        for force in forces:
            self._compare_force(force, again.get((force.participant, force.right)))
        if self._compare_told(view, recorded):
            self._compare_details(view, details)

    def _compare_told(self, view: WorldView, recorded: Sequence[WorldState | None]) -> bool:
        """Whether a message went out with this step."""
        if self._encoder.silent and (whole := recorded[1]) is not None:
            with contextlib.suppress(FrameError):
                self._encoder.continue_from(view, whole)
                return True
        encoded = self._encoder.encode(view)
        for found, again in zip(recorded, encoded, strict=True):
            if found is not None and again is not None:
                self._compare(found, again)
            elif again is not None:
                self._skip("the state is not in the log")
            elif found is not None:
                self._skip("before the first key frame after a gap")
        return encoded.state is not None

    def _compare_details(self, view: WorldView, recorded: dict[str, WorldDetail]) -> None:
        assert self._world is not None
        again = self._encoder.details(self._world.eyes, view.t_ns)
        for who, found in recorded.items():
            if not self.difference and (who not in again or not _same(found, again[who])):
                self.difference = f"step {view.step}: the detail that {who} got differs"

    def _begin(self, message: WorldInputs, begins: bool) -> bool:
        """Take the recorded state before this step, or compare with it; False when that is impossible."""
        if self._world is not None:
            if self._world.snapshot() != message.private_state:
                self.difference = f"step {message.step}: the state before it differs from the re-run"
                return False
            return True
        try:
            self._world = World.restore(message.private_state)
        except ValueError as e:
            self._skip(str(e))
            return False
        self._encoder = WorldEncoder(begins=begins)
        return True

    def _inputs(self, message: WorldInputs) -> StepInputs | None:
        motions: list[MotionInput] = []
        for used in message.motions:
            if used.left:
                continue
            found = self._motions.get((used.participant, used.motion_seq, used.epoch))
            if found is None:
                return None
            motions.append(found)
        return StepInputs(
            message.step,
            message.header.t_ns,
            people_of(message),
            tuple(motions),
            tuple(used.participant for used in message.motions if used.left),
            tuple(command_input(c.participant, c) for c in message.commands),
            tuple(prop_input(p) for p in message.props),
        )

    def _skip(self, why: str) -> None:
        self.skipped[why] = self.skipped.get(why, 0) + 1

    def _compare(self, recorded: WorldState, again: WorldState) -> None:
        if _same(recorded, again):
            self.steps += 1
            return
        self.difference = f"step {recorded.step}: {_what_differs(recorded, again)}"

    def _compare_force(self, recorded: HandForce, again: HandForce | None) -> None:
        hand = f"{recorded.participant}'s {'right' if recorded.right else 'left'} hand"
        if again is None:
            self.difference = f"step {recorded.step}: {hand} feels something in the log and nothing in the re-run"
        elif _same(recorded, again):
            self.hand_forces += 1
        else:
            self.difference = f"step {recorded.step}: what {hand} feels differs"


def _same(recorded: _Message, again: _Message) -> bool:
    """Equal but for the header, which is the bus's."""
    t_ns = again.header.t_ns
    again.header.CopyFrom(recorded.header)
    again.header.t_ns = t_ns
    return recorded.SerializeToString(deterministic=True) == again.SerializeToString(deterministic=True)


def _what_differs(recorded: WorldState, again: WorldState) -> str:
    """The first field that differs, with its element."""
    for f in WorldState.DESCRIPTOR.fields:
        a, b = getattr(recorded, f.name), getattr(again, f.name)
        if a == b:
            continue
        if not f.is_repeated:
            return f"{f.name} is {str(a).strip()!r} in the log and {str(b).strip()!r} in the re-run"
        if len(a) != len(b):
            return f"{len(a)} {f.name} in the log, {len(b)} in the re-run"
        for x, y in zip(a, b, strict=True):
            if x != y:
                one, other = (" ".join(str(v).split()) for v in (x, y))
                return f"{f.name}: {one} in the log, {other} in the re-run"
    return "the bytes differ, though every known field is the same; the log was written by another version"

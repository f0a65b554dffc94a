"""What must hold in a conference whatever breaks, held against a log that heard all of it.

Each function gives a line for every violation; none, where all held. `records` are those of the log in its order; each function
takes the topics that it needs and no others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from vistel.conference.model import PREDICTED_S
from vistel.messages.world.verify import Record
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.log import LogRecord
from vistel.wire.topics import BY_NAME
from vistel.wire.world import recorded

MOST_GROWTH = 0.05
"""Of a process's memory."""
MOST_GROWTH_BYTES = 8 << 20
"""And so much besides: buffers of a program's start, which a process that was started again has not filled yet."""
SOAK_GROWTH = 0.01
"""Of a process's memory, where nothing strikes."""
TOLD_BY_LEADER = ("world_inputs", "world_state")
"""Topics of which the leader tells a message for each step, or for each other one. The bus hears the first from one sender at a
time, the second from all."""
MOST_LINES = 5
"""Violations of one kind that are told; the rest is counted."""


@dataclass(frozen=True)
class Span:
    """From when to when something was broken [ns of conference time]."""

    begin_ns: int
    end_ns: int

    def holds(self, t_ns: int) -> bool:
        """Whether `t_ns` is within."""
        return self.begin_ns <= t_ns <= self.end_ns


def one_leader(records: Iterable[Record]) -> list[str]:
    """Of the steps of the room that were told, each was told once and after the one before it, and the term never fell. A second
    leader would tell steps that were told already, or of a lower term; a world that lost what it had told would tell them anew."""
    found = _Lines()
    newest: dict[str, tuple[int, int]] = {}
    for topic, _, message, _ in records:
        if topic not in TOLD_BY_LEADER:
            continue
        term, step = newest.get(topic, (0, 0))
        if message.header.term < term:
            found.add(f"step {message.step} was told under term {message.header.term}, after step {step} under term {term}")
        elif message.step <= step:
            found.add(f"step {message.step} under term {message.header.term} was told after step {step}")
        newest[topic] = max(term, message.header.term), max(step, message.step)
    return found.lines()


@dataclass
class _Command:
    participant: str
    number: int
    """Of those of the participant, in the order asked."""
    creates: bool
    deletes: str = ""
    result: CommandResult | None = None
    at: tuple[int, int] | None = None
    """Step, and place among the commands of the step, at which it was first taken."""


@dataclass
class _Heard:
    commands: dict[str, _Command] = field(default_factory=dict[str, _Command])
    results: dict[str, list[CommandResult]] = field(default_factory=dict[str, list[CommandResult]])
    """Of commands that have not been heard: the world may hear one, and its answer come, before who asked is heard."""
    differing: list[str] = field(default_factory=list[str])
    first: tuple[int, frozenset[str]] = (0, frozenset())
    last: tuple[int, frozenset[str]] = (0, frozenset())
    """The first and the last room that were told: the step, and the things in it."""


def commands_once_and_in_order(records: Iterable[Record]) -> list[str]:
    """Every command that was acknowledged as done was done, once, and those of one participant in the order in which they were
    asked; and what acknowledged commands made and took away is there at the end, and is not."""
    heard = _heard(records)
    found = _Lines(heard.differing)
    done: list[tuple[tuple[int, int], str, _Command]] = []
    last: dict[str, tuple[tuple[int, int], str, int]] = {}
    for name, c in heard.commands.items():
        if c.result is None or c.result.outcome != CommandResult.OUTCOME_DONE:
            continue
        if c.at is None or c.at[0] != c.result.step:
            where = "in no step" if c.at is None else f"first at step {c.at[0]}"
            found.add(f"command {name} of {c.participant} was acknowledged as done at step {c.result.step} and taken {where}")
            continue
        done.append((c.at, name, c))
        before = last.get(c.participant)
        if before is not None and c.number > before[2] and c.at < before[0]:
            found.add(f"command {name} of {c.participant} was done before {before[1]}, which was asked earlier")
        last[c.participant] = (c.at, name, c.number)
    _check_things(heard, sorted(done, key=lambda d: d[0]), found)
    return found.lines()


def _check_things(heard: _Heard, done: Sequence[tuple[tuple[int, int], str, _Command]], found: _Lines) -> None:
    """The things that the acknowledged commands made and took away, against those of the last room."""
    alive, (end, room) = set(heard.first[1]), heard.last
    open_ = [c for c in heard.commands.values() if c.result is None]
    taken = [(c.at, "", c) for c in open_ if c.at is not None]
    perhaps_gone, perhaps_made = set[str](), 0
    for at, name, c in sorted([*done, *taken], key=lambda d: d[0]):
        if not heard.first[0] < at[0] <= end:
            continue
        things = set(c.result.things if c.result is not None else ())
        if c.result is None:  # done, or refused; nobody was told
            perhaps_gone |= {c.deletes} & alive
            perhaps_made += c.creates
        elif c.creates:
            for thing in sorted(things & alive - perhaps_gone):
                found.add(f"{thing} was made by {name}, and was there before")
            alive |= things
        elif c.deletes:
            strange = sorted(things - alive)
            for thing in strange[perhaps_made:]:
                found.add(f"{thing} was taken away by {name}, and was not there")
            perhaps_made -= min(perhaps_made, len(strange))
            alive -= things
        perhaps_gone -= things
    maybe_gone = {c.deletes for c in open_ if c.deletes}
    for thing in sorted(alive - room - maybe_gone):
        found.add(f"{thing} was made, and is not there at the end")
    extra = sorted(room - alive)
    if len(extra) > sum(c.creates for c in open_):
        found.add(f"{', '.join(extra)}: there at the end, though taken away or never acknowledged as made")


def _heard(records: Iterable[Record]) -> _Heard:
    heard, world = _Heard(), recorded.RecordedWorld()
    numbers: dict[str, int] = {}
    waiting: dict[str, tuple[int, int]] = {}
    for topic, names, message, log_ns in records:
        match topic:
            case "command":
                who = names["participant"]
                numbers[who] = numbers.get(who, 0) + 1
                which = message.delete.thing or message.delete.which.thing
                c = _Command(who, numbers[who], message.HasField("create"), which)
                c.at = waiting.pop(message.id, None)
                heard.commands.setdefault(message.id, c)
                for result in heard.results.pop(message.id, []):
                    _answered(heard, result)
            case "world_inputs":
                for place, name in enumerate(message.command_ids):
                    if name not in heard.commands:  # the world may be heard before who asked
                        waiting.setdefault(name, (message.step, place))
                    elif heard.commands[name].at is None:
                        heard.commands[name].at = (message.step, place)
            case "command_result":
                _answered(heard, message)
            case "world_state" | "world_key" | "world_detail":
                for state in world.take(LogRecord(BY_NAME[topic], "", names, message, log_ns, 0)):
                    heard.last = state.step, frozenset(state.things)
                    heard.first = heard.first if heard.first[0] else heard.last
            case _:
                pass
    return heard


def _answered(heard: _Heard, result: CommandResult) -> None:
    asked = heard.commands.get(result.id)
    if asked is None:  # or it was asked before the log began
        heard.results.setdefault(result.id, []).append(result)
        return
    if asked.result is None:
        asked.result = result
    elif CommandResult.OUTCOME_DONE in (asked.result.outcome, result.outcome):
        first, again = (_outcome(r) for r in (asked.result, result))
        if first != again:
            heard.differing.append(f"command {result.id} of {asked.participant} was answered as {first}, then as {again}")


def _outcome(result: CommandResult) -> str:
    word = "done" if result.outcome == CommandResult.OUTCOME_DONE else "refused"
    return f"{word} at step {result.step} ({', '.join(result.things) or 'nothing'})"


def no_stale_motion(records: Iterable[Record], clock_steps: Sequence[Span] = ()) -> list[str]:
    """No picture showed a participant as they were before what an earlier picture of the same renderer had shown; where nothing new
    came, by no more than had been predicted.

    clock_steps: while clocks were set, times cannot be compared."""
    found = _Lines()
    shown: dict[tuple[str, str], tuple[int, int]] = {}
    for topic, _, message, log_ns in records:
        if topic != "image_delay":
            continue
        for stream in message.streams:
            key = message.site, stream.participant
            before = shown.get(key)
            compared = before is not None and message.frames > before[1] and not any(s.holds(log_ns) for s in clock_steps)
            if before is not None and compared and stream.shown_ns < before[0] - PREDICTED_S * 1e9:
                found.add(f"{message.site} showed {stream.participant} {(before[0] - stream.shown_ns) * 1e-9:.2f} s back in time")
            shown[key] = (stream.shown_ns, message.frames)
    return found.lines()


def memory_back(
    before: Mapping[str, int], after: Mapping[str, int], growth: float = MOST_GROWTH, most: int = MOST_GROWTH_BYTES
) -> list[str]:
    """Every process has about as much memory [bytes] as before, and none is missing. growth, most: how much more it may have, as a
    share and in bytes."""
    found = _Lines([f"{name}: is not there at the end" for name in sorted(before.keys() - after.keys())])
    for name in sorted(before.keys() & after.keys()):
        if after[name] > before[name] * (1 + growth) + most:
            found.add(f"{name}: {before[name] / 1e6:.1f} MB before, {after[name] / 1e6:.1f} MB after")
    return found.lines()


def files_back(before: Mapping[str, int], after: Mapping[str, int]) -> list[str]:
    """No process has more files open than before."""
    found = _Lines()
    for name in sorted(before.keys() & after.keys()):
        if after[name] > before[name]:
            found.add(f"{name}: {before[name]} files open before, {after[name]} after")
    return found.lines()


class _Lines:
    def __init__(self, lines: Sequence[str] = ()) -> None:
        self._all = list(lines)

    def add(self, line: str) -> None:
        self._all.append(line)

    def lines(self) -> list[str]:
        more = len(self._all) - MOST_LINES
        return self._all[:MOST_LINES] + ([f"… and {more} more"] if more > 0 else [])

"""What the host can do to a running conference from the console, each as a message on the bus."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from vistel.conference.invitations import RefusedError
from vistel.conference.model import Conference
from vistel.host import HOST
from vistel.messages.notes import NoteError, note
from vistel.one_line import one_line
from vistel.session.asking import Asker
from vistel.session.steering.moving import PresentWorlds, move_room
from vistel.session.steering.seating import give_seat, take_seat
from vistel.space.commands.phrase import PhraseError
from vistel.v1.audio_pb2 import Muting, SoundStatus
from vistel.v1.service_pb2 import FaultReply, FaultRequest, RunReply, RunRequest
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, within
from vistel.wire.topics import BY_NAME

MOST_LETTERS = 500
"""Of a word or a line that a page sends."""
ANSWER_S = 10.0
"""How long `vistel up`, or a site's sound, may take to answer [s]; a busy machine is late, and an answer that comes later is
told as if there were none, though what was asked is done."""
_DO = {"start": RunRequest.ACTION_START, "stop": RunRequest.ACTION_STOP, "restart": RunRequest.ACTION_RESTART}
_NO_RUN = "no `vistel up` answers; only what it started can be steered so"


@dataclass(frozen=True)
class Done:
    """What became of an action. done: false where it was refused; answer: one line for a person; text: what it was done to, or
    with; token: of a guest's link, which is told to nobody but the host's page; why, values: of a refusal, as of `RefusedError`."""

    done: bool
    answer: str
    text: str = ""
    token: str = ""
    why: str = ""
    values: tuple[str, ...] = ()


class HostActions:
    """Lives on the event loop."""

    def __init__(self, conference: Conference, run: Path, bus: Bus, clock: Clock) -> None:
        """run: folder of the run, with its invitations."""
        self._conference, self._run, self._bus, self._clock = conference, run, bus, clock
        self._people = {p.name: (site, p) for site in conference.sites for p in site.participants}
        self._asker = Asker(bus, clock, HOST)
        self.worlds = PresentWorlds(bus)

    def close(self) -> None:
        """Receive no more."""
        self._asker.close()

    async def do(self, action: str, asked: dict[str, object], by: str) -> Done:
        """One action; asked: its words, as a page sent them."""
        try:
            match action:
                case "ask":
                    return await self._ask(_word(asked, "text"))
                case "fault":
                    return await self._fault(asked, by)
                case "start" | "stop" | "restart":
                    return await self._process(action, _word(asked, "process"), by)
                case "move":
                    return await self._move(_word(asked, "place"))
                case "mute":
                    return await self._mute(_word(asked, "participant"))
                case "seat":
                    return self._seat(_word(asked, "name"), _word(asked, "seat"))
                case "remove":
                    participant = _word(asked, "participant")
                    return Done(True, take_seat(self._conference, self._run, participant), participant)
                case "note":
                    return self._note(asked.get("author", by), asked.get("note"))
                case _:
                    raise RefusedError(f"no action is called {action[:40]!r}")
        except RefusedError as e:
            return Done(False, str(e), _text(asked), why=e.why, values=e.values)
        except (PhraseError, NoteError) as e:
            return Done(False, str(e), _text(asked))
        except (OSError, ValueError) as e:
            return Done(False, f"the invitations of this run cannot be used: {e}", _text(asked))

    async def run(self, request: RunRequest) -> RunReply | None:
        """What `vistel up` answers; None where there is none."""
        return await self._bus.query(BY_NAME["run"], request, ANSWER_S)

    async def _ask(self, line: str) -> Done:
        answer = await self._asker.ask(line)
        return Done(answer.done, ", ".join(answer.things) if answer.done else answer.reason, line)

    async def _fault(self, asked: dict[str, object], by: str) -> Done:
        name, target = _word(asked, "name"), _word(asked, "target")
        request = FaultRequest(name=name, target=target, by=by, seconds=_number(asked, "seconds"), amount=_number(asked, "amount"))
        reply: FaultReply | None = await self._bus.query(BY_NAME["fault"], request, ANSWER_S)
        if reply is None:
            return Done(False, _NO_RUN, f"{name} {target}".strip(), why="no_run")
        return Done(not reply.refused, reply.refused or reply.struck, f"{name} {target}".strip())

    async def _process(self, action: str, process: str, by: str) -> Done:
        reply = await self.run(RunRequest(action=_DO[action], process=process, by=by))
        if reply is None:
            return Done(False, _NO_RUN, process, why="no_run")
        return Done(not reply.refused, reply.refused or reply.done, process)

    async def _move(self, place: str) -> Done:
        if place not in {world.place for world in self.worlds.now()}:
            there = ", ".join(w.place for w in self.worlds.now())
            raise RefusedError(f"no world is at {place[:40]!r}; there are {there}", "no_world", place[:40], there)
        reason, _ = await move_room(self._bus, self.worlds, place)
        return Done(not reason, reason or f"the room is led at {place}", place)

    async def _mute(self, participant: str) -> Done:
        if participant not in self._people:
            raise RefusedError(f"no participant is called {participant[:40]!r}", "no_participant", participant[:40])
        site, person = self._people[participant]
        if site.microphone_of(person) == "none":
            raise RefusedError(f"{participant} has no microphone", "no_microphone", participant)
        message = Muting(participant=participant)
        message.header.t_ns = self._clock.now_ns()
        said = self._bus.subscribe(BY_NAME["sound_status"], site=site.name)
        try:
            self._bus.publish(BY_NAME["muting"], participant=participant).put(message)
            async with within(self._clock, ANSWER_S):
                async for sample in said:
                    status: SoundStatus = sample.message
                    if any(m.participant == participant and m.muted for m in status.microphones):
                        return Done(True, f"{participant} is muted until they open their microphone again", participant)
        except TimeoutError:
            pass
        finally:
            said.close()
        reason = f"the sound of {site.name} does not say that {participant} is muted; is it running?"
        raise RefusedError(reason, "not_muted", site.name, participant)

    def _seat(self, name: str, seat: str) -> Done:
        chosen, token = give_seat(self._conference, self._run, name, seat, self._clock.now_ns())
        return Done(True, f"{name} is invited to the seat {chosen}", f"{name} {chosen}", token)

    def _note(self, by: object, text: object) -> Done:
        new = note(self._clock.now_ns(), by, text)
        self._bus.publish(BY_NAME["note"]).put(new.message)
        return Done(True, new.text, new.text)


def _word(asked: dict[str, object], name: str) -> str:
    """Raises RefusedError."""
    found = asked.get(name, "")
    if not isinstance(found, str) or len(found) > MOST_LETTERS or not found.isprintable():
        raise RefusedError(f"{name}: expected a line of at most {MOST_LETTERS} letters")
    return found.strip()


def _number(asked: dict[str, object], name: str) -> float | None:
    """Raises RefusedError."""
    found = asked.get(name)
    if found is None:
        return None
    if isinstance(found, bool) or not isinstance(found, int | float) or not math.isfinite(found):
        raise RefusedError(f"{name}: expected a number")
    return float(found)


def _text(asked: dict[str, object]) -> str:
    """What was asked, for the log, where it was refused."""
    words = [str(v) for k, v in asked.items() if k not in ("do", "id", "by", "author")]
    return one_line(" ".join(words))[:MOST_LETTERS]

"""Some participants of a crowd, each with a link of its own: sends their motion and voices, and receives what their sites would.

What is received is counted by nobody and decoded by nobody: a generator of load must not become the bottleneck itself.

python -m vistel_sim.crowd.process CONFERENCE.toml --router tcp/127.0.0.1:7447 --first 0 --count 50
"""

# zenoh's stubs leave return types out
# pyright: reportUnknownMemberType=false
from __future__ import annotations

import argparse
import json
import os
import signal
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import zenoh

from vistel.conference.files import load
from vistel.conference.model import Conference
from vistel.conference.seats import seat_place
from vistel.v1.audio_pb2 import Voice
from vistel.v1.motion_pb2 import Motion
from vistel.wire.clock import SystemClock
from vistel.wire.motion.interest import nearest
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION, Topic
from vistel.wire.zenoh.config import as_text, client_config
from vistel_sim.crowd.conference import talkers
from vistel_sim.crowd.loops import THIN, MotionLoop, motion_loops

FRAME_NS = 1_000_000_000 // 60
PACKET_NS = 20_000_000
LEVEL_PACKETS = 12
"""Voice packets from one level to the next."""
PACKET = bytes(range(60))
"""Opus at 24 kbit/s."""
GIVES_WAY = 5
"""Niceness beside what is measured, which has its machine for itself outside of a test."""
SETTLED_NS = 5_000_000_000
"""Lateness before this is that of the start."""


class _Participant:
    """One of the crowd, at a site of its own."""

    def __init__(self, conference: Conference, number: int, router: str, loop: MotionLoop) -> None:
        self.number, self._loop = number, loop
        self._name, self._crowded = f"person-{number}", bool(conference.crowd)
        self._count = len(conference.sites)
        self._conference = conference
        self._session = zenoh.open(zenoh.Config.from_json5(as_text(client_config([router]))))
        self._motion, self._thin, self._voice, self._level = (
            self._publisher(BY_NAME[t]) for t in ("motion", "motion_thin", "voice", "voice_level")
        )
        self._heard: dict[str, list[Any]] = {}
        self._frame = self._packet = 0
        self._near: frozenset[str] = frozenset()
        self._loud: frozenset[int] = frozenset()

    def _publisher(self, topic: Topic) -> Any:
        key = topic.format(conference=self._conference.name, site=f"site-{self.number}", participant=self._name)
        return self._session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.DROP, reliability=zenoh.Reliability.BEST_EFFORT
        )

    def _subscribe(self, topic: str, **names: str) -> Any:
        pattern = BY_NAME[topic].pattern(self._conference.name, **names)
        return self._session.declare_subscriber(pattern, zenoh.handlers.RingChannel(1))

    def listen(self, loud: frozenset[int]) -> None:
        """Receive what a site receives: of a small conference everything, of a crowd what it chooses."""
        if not self._heard:
            wide = ("motion_thin", "voice_level") if self._crowded else ("motion", "voice")
            self._heard[""] = [self._subscribe(t) for t in (*wide, "world_state", "world_key")]
            self._heard[""].append(self._subscribe("world_detail", participant=self._name))
            places = {f"person-{i}": seat_place(self._conference.room, i)[0] for i in range(self._count)}
            self._near = nearest([places.pop(self._name)], places)
        if not self._crowded:
            return
        wanted = {self._name, *self._near, *(f"person-{i}" for i in loud)}
        for name in self._heard.keys() - wanted - {""}:
            for subscriber in self._heard.pop(name):
                subscriber.undeclare()
        for name in wanted - self._heard.keys():
            topics = ("motion",) if name == self._name else ("motion", "voice")
            self._heard[name] = [self._subscribe(t, participant=name, site=name.replace("person", "site")) for t in topics]

    def move(self, now_ns: int) -> None:
        """Send the next sixtieth of a second."""
        k = self._frame
        self._frame += 1
        self._send(self._motion, k + 1, now_ns, self._loop.full[k % len(self._loop.full)])
        if self._crowded and k % THIN == 0:
            k //= THIN
            self._send(self._thin, k + 1, now_ns, self._loop.thin[k % len(self._loop.thin)])

    def _send(self, publisher: Any, seq: int, t_ns: int, frame: bytes) -> None:
        message = Motion(frame=frame)
        message.header.version, message.header.seq, message.header.t_ns = MESSAGE_VERSION, seq, t_ns
        publisher.put(message.SerializeToString())

    def talk(self, now_ns: int) -> None:
        """Send the next packet of the voice, and at times how loud it is."""
        self._packet += 1
        message = Voice(level_db=-20.0, talking=True)
        message.header.version, message.header.seq, message.header.t_ns = MESSAGE_VERSION, self._packet, now_ns
        if self._crowded and self._packet % LEVEL_PACKETS == 0:
            self._level.put(message.SerializeToString())
        message.opus = PACKET
        message.earlier.append(PACKET)
        self._voice.put(message.SerializeToString())

    def close(self) -> None:
        self._session.close()


def main(arguments: Sequence[str] | None = None) -> None:
    """Send until SIGTERM; then print how late messages were sent, as JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conference", type=Path)
    parser.add_argument("--router", required=True)
    parser.add_argument("--first", type=int, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--receive", type=int, required=True, help="how many of the participants with the lowest numbers receive")
    given = parser.parse_args(arguments)
    os.nice(GIVES_WAY)
    conference = load(given.conference)
    numbers = range(given.first, given.first + given.count)
    loops = motion_loops(conference, numbers)
    people = [_Participant(conference, i, given.router, loop) for i, loop in zip(numbers, loops, strict=True)]
    stopped: list[int] = []
    for signum in (signal.SIGTERM, signal.SIGINT):
        signal.signal(signum, lambda number, _: stopped.append(number))
    late_ms = _send(conference, people, given.receive, stopped)
    print(json.dumps({"late_p99_ms": round(float(np.percentile(late_ms or [0.0], 99)), 2)}), flush=True)
    for person in people:
        person.close()


def _send(conference: Conference, people: list[_Participant], receive: int, stopped: list[int]) -> list[float]:
    """Until `stopped` has something; how late each frame was [ms]. Everybody's frames are spread over the sixtieth of a second."""
    clock, count = SystemClock(), len(conference.sites)
    late_ms: list[float] = []
    loud: frozenset[int] = frozenset()
    print("ready", flush=True)
    begun_ns = clock.now_ns()
    voice_ns = dict.fromkeys((p.number for p in people), 0)
    tick = 0
    while not stopped:
        now_loud = talkers(count, clock.now_ns() * 1e-9)
        if now_loud != loud:
            loud = now_loud
            for person in people:
                if person.number < receive:
                    person.listen(loud - {person.number})
        for i, person in enumerate(people):
            due_ns = begun_ns + tick * FRAME_NS + i * FRAME_NS // len(people)
            wait_ns = due_ns - clock.now_ns()
            if wait_ns > 300_000:
                time.sleep(wait_ns * 1e-9)
            now_ns = clock.now_ns()
            if due_ns - begun_ns > SETTLED_NS:
                late_ms.append((now_ns - due_ns) * 1e-6)
            person.move(now_ns)
            if person.number in loud:
                if now_ns - voice_ns[person.number] > 10 * PACKET_NS:
                    voice_ns[person.number] = now_ns
                while voice_ns[person.number] <= now_ns:
                    person.talk(voice_ns[person.number])
                    voice_ns[person.number] += PACKET_NS
        tick += 1
        behind = (clock.now_ns() - begun_ns) // FRAME_NS - tick
        tick += behind if behind > 12 else 0  # after a pause go on from now
    return late_ms


if __name__ == "__main__":
    main()

"""The journal of a room: what went into every step, on disk before what came of it is said.

A world that was killed takes these steps again from its last snapshot; the same inputs give the same bytes, so it is where
it was, and nothing that anybody was told is lost. A record is its length, its CRC-32 and a `JournalStep`. Damage costs the
records it is in, and no others: reading goes on at the next one that is whole.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from google.protobuf.message import DecodeError

from vistel.figure.posture.posture import Posture, Stance
from vistel.messages.world.decode import command_input, people_of, prop_input
from vistel.space.inputs import MotionInput, StepInputs
from vistel.v1.world_pb2 import JournalStep, WorldInputs
from vistel.whole_file import sync_folder

_FRAME = struct.Struct("<II")
LONGEST = 1 << 26
"""Bytes of a record; what says it is longer is damaged."""


def record(message: WorldInputs, inputs: StepInputs) -> bytes:
    """One step as it stands in the file. message: the inputs as they are told, still without the state before them."""
    step = JournalStep(inputs=message)
    for m in inputs.motions:
        p = m.posture
        numbers = np.concatenate([p.dofs, p.hands.ravel(), p.stance.position, [p.stance.heading], p.gaze])
        taken = step.motions.add(participant=m.participant, seq=m.seq, t_ns=m.t_ns, numbers=numbers.tobytes())
        if p.joints:
            taken.joints.extend(sorted(p.joints))
            taken.joint_numbers = b"".join(np.asarray(p.joints[name], np.float64).tobytes() for name in taken.joints)
    payload = step.SerializeToString()
    return _FRAME.pack(len(payload), zlib.crc32(payload)) + payload


def inputs_of(step: JournalStep) -> StepInputs:
    """What goes into the world. Raises ValueError for a record that is none."""
    message = step.inputs
    return StepInputs(
        message.step,
        message.header.t_ns,
        people_of(message),
        tuple(_motion(m) for m in step.motions),
        tuple(used.participant for used in message.motions if used.left),
        tuple(command_input(c.participant, c) for c in message.commands),
        tuple(prop_input(p) for p in message.props),
    )


def _motion(m: JournalStep.Taken) -> MotionInput:
    n = np.frombuffer(m.numbers, np.float64).copy()
    if len(n) != 71:
        raise ValueError(f"journal: a posture of {len(n)} numbers, expected 71")
    joints = np.frombuffer(m.joint_numbers, np.float64).reshape(len(m.joints), 3).copy()
    posture = Posture(
        n[:25], n[25:65].reshape(2, 20), Stance(n[65:68], float(n[68])), n[69:71], dict(zip(m.joints, joints, strict=True))
    )
    return MotionInput(m.participant, posture, m.seq, m.t_ns)


@dataclass(frozen=True)
class Damage:
    """Bytes `begin` to `end` of a journal, after step `after` (0: none yet), are no records. cut: the file ends there, as after a
    death in the middle of writing."""

    begin: int
    end: int
    after: int
    cut: bool


def read(path: Path, on_damage: Callable[[Damage], object] = lambda _damage: None) -> Iterator[JournalStep]:
    """The records of a file that are whole; on_damage is called for what lies between them. Raises OSError."""
    data = path.read_bytes()
    at = after = 0
    while at < len(data):
        found, begin = _record_at(data, at), at
        while found is None and at < len(data):
            at += 1
            found = _record_at(data, at)
        if at > begin:
            on_damage(Damage(begin, at, after, at == len(data)))
        if found is not None:
            step, at = found
            after = step.inputs.step
            yield step


def _record_at(data: bytes, at: int) -> tuple[JournalStep, int] | None:
    """The record that begins at byte `at`, and where it ends; None where none does."""
    begin = at + _FRAME.size
    if begin > len(data):
        return None
    size, crc = _FRAME.unpack_from(data, at)
    payload = memoryview(data)[begin : begin + size]
    if not 0 < size <= LONGEST or len(payload) < size or zlib.crc32(payload) != crc:
        return None
    try:
        return JournalStep.FromString(bytes(payload)), begin + size
    except DecodeError:
        return None


class Journal:
    """A file that grows by whole records. `append` on one thread; `sync` on any."""

    def __init__(self, path: Path) -> None:
        """Begin an empty one. Raises OSError."""
        self.path = path
        self._file = os.open(path, os.O_CREAT | os.O_TRUNC | os.O_WRONLY | os.O_APPEND, 0o644)
        self._size = self._synced = 0

    def append(self, data: bytes) -> None:
        """Add a record, which outlives this process once this returns. Raises OSError, and then nothing was added."""
        left = memoryview(data)
        try:
            while left:
                left = left[os.write(self._file, left) :]
        except OSError:
            os.ftruncate(self._file, self._size)
            raise
        self._size += len(data)

    def sync(self) -> None:
        """See to it that all that was appended before outlives the machine's power. Raises OSError: then it may be lost."""
        size = self._size
        if size > self._synced:
            os.fsync(self._file)
            if not self._synced:
                sync_folder(self.path.parent)
            self._synced = size

    def close(self) -> None:
        """No more is appended."""
        os.close(self._file)

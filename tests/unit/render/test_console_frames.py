"""The console's frames: what they hold comes back, on the page as well, and what is broken is no frame."""

from __future__ import annotations

import base64
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_module import in_node

from vistel.arrays import F64
from vistel.figure.face.arkit import SHAPES
from vistel.figure.posture.posture import Posture, Stance, pose_joints
from vistel.figure.skeleton import JOINTS, PARENTS, Skeleton, standard_skeleton
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.render.frames import (
    BODY,
    FINGERS,
    FORMAT,
    HEADER,
    PERSON,
    SHIFT_M,
    SHIFTED,
    THING,
    header,
    joints_told,
    person_row,
    quaternions,
    thing_rows,
)

FRAMES_PER_S = 30


def posture(seed: int) -> Posture:
    """Somebody in motion, with everything that a posture can hold."""
    rng = np.random.default_rng(seed)
    dofs = rng.uniform(-0.6, 0.6, 25)
    dofs[5:8] = rng.uniform(-0.02, 0.02, 3)
    joints = {"left_toes": rng.uniform(-0.4, 0.4, 3), "jaw": np.array((0.2, 0.0, 0.0))} if seed % 2 else {}
    stance = Stance(rng.uniform(-3, 3, 3), float(rng.uniform(-4, 4)))
    return Posture(dofs, rng.uniform(-0.3, 1.4, (2, 20)), stance, rng.uniform(-0.3, 0.3, 2), joints)


def frame(people: list[Posture], things: int = 2, *, skeleton: Skeleton) -> bytes:
    rng = np.random.default_rng(3)
    face = np.linspace(0.0, 1.0, len(SHAPES))
    rows = [person_row(n, pose_joints(skeleton, p), face, talks=n == 0).tobytes() for n, p in enumerate(people)]
    turns = rng.normal(size=(things, 4))
    lying = [(n, rng.uniform(-2, 2, 3), q / np.linalg.norm(q)) for n, q in enumerate(turns)]
    return header(70_000, len(people), things, 123.5) + b"".join(rows) + thing_rows(lying).tobytes()


def rotations_of(row: np.void) -> F64:
    """(J, 4) quaternions of a person's row: the reference decoder."""
    out = np.zeros((len(JOINTS), 4))
    packed = [(j, (int(w[0]) >> 15) | (int(w[1]) >> 15) << 1, w & 0x7FFF, 0x7FFF) for j, w in zip(BODY, row["body"], strict=True)]
    for j, word in zip(FINGERS, row["fingers"].astype(int), strict=True):
        packed.append((j, word >> 30, np.array((word >> 20 & 1023, word >> 10 & 1023, word & 1023)), 1023))
    for j, missing, three, most in packed:
        others = (three.astype(float) * 2 / most - 1) * math.sqrt(0.5)
        out[j, [k for k in range(4) if k != missing]] = others
        out[j, missing] = math.sqrt(max(0.0, 1.0 - float(others @ others)))
    return out


def places_of(rotations: F64, hips: F64, shifts: F64, skeleton: Skeleton) -> F64:
    """(J, 3) joints in the room, as the page's scene puts them there."""
    offsets = skeleton.offsets.copy()
    offsets[SHIFTED] = shifts
    turned, at = np.zeros((len(JOINTS), 3, 3)), np.zeros((len(JOINTS), 3))
    for j, p in enumerate(PARENTS):
        own = matrix_from_quaternion(np.ascontiguousarray(rotations[j] / np.linalg.norm(rotations[j])))
        turned[j] = own if p < 0 else turned[p] @ own
        at[j] = hips if p < 0 else at[p] + turned[p] @ offsets[j]
    return at


@pytest.mark.parametrize("height", [1.3, 1.98])
def test_joints_come_back_within_a_millimetre(height: float) -> None:
    skeleton = standard_skeleton(height)
    worst = 0.0
    for seed in range(40):
        joints = pose_joints(skeleton, posture(seed))
        row = person_row(5, joints, np.zeros(len(SHAPES)), talks=False)
        shifts = row["shifts"].astype(float) * SHIFT_M
        there = places_of(rotations_of(row), row["hips"].astype(float), shifts, skeleton)
        worst = max(worst, float(np.abs(there - joints.position).max()))
    assert worst < 1e-3


def test_quaternions_of_half_turns_and_none() -> None:
    turns = np.array([np.diag(d) for d in ((1.0, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))])
    assert np.abs(quaternions(turns) - np.array(((0, 0, 0, 1.0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)))).max() < 1e-12


def test_a_person_takes_less_than_120_kilobits_a_second() -> None:
    assert (HEADER.size + PERSON.itemsize) * 8 * FRAMES_PER_S <= 120_000
    assert len(frame([posture(1)], 0, skeleton=standard_skeleton())) == HEADER.size + PERSON.itemsize


_DECODE = """
import { decode } from "./module.mjs";
const { told, frames } = given;
const bytes = (text) => new Uint8Array(Buffer.from(text, "base64")).buffer;
const listed = (p) => ({ ...p, rotations: [...p.rotations], shifts: [...p.shifts], face: [...p.face] });
const plain = (f) => f && { ...f, people: f.people.map(listed) };
console.log(JSON.stringify(frames.map((f) => plain(decode(bytes(f), told)))));
"""


@pytest.fixture
def page_decodes(tmp_path: Path) -> Any:
    """What the page's own decoder makes of frames; None of those that it refuses."""
    run = in_node(tmp_path, "console/wire.ts", _DECODE)

    def decoded(frames: list[bytes]) -> list[Any]:
        return run({"told": json.loads(joints_told()), "frames": [base64.b64encode(f).decode() for f in frames]})

    return decoded


def test_the_page_reads_what_is_written_and_refuses_what_is_broken(page_decodes: Any) -> None:
    skeleton = standard_skeleton(1.7)
    people = [posture(n) for n in range(3)]
    whole = frame(people, skeleton=skeleton)
    rng = np.random.default_rng(1)
    broken = [b"", whole[:9], whole[:-1], whole + b"x", bytes([FORMAT + 1]) + whole[1:], rng.bytes(400)]
    noise = [header(1, 1, 1, 0.0) + rng.bytes(PERSON.itemsize + THING.itemsize) for _ in range(20)]
    read, *others = page_decodes([whole, *broken, *noise])
    assert others[: len(broken)] == [None] * len(broken)
    assert all(len(f["people"]) == 1 for f in others[len(broken) :])
    assert read["table"] == 70_000 % 65_536 and read["tMs"] == 123.5 and len(read["things"]) == 2
    for n, (seen, meant) in enumerate(zip(read["people"], people, strict=True)):
        joints = pose_joints(skeleton, meant)
        rotations = np.array(seen["rotations"]).reshape(-1, 4)
        row = person_row(n, joints, np.linspace(0.0, 1.0, len(SHAPES)), talks=n == 0)
        assert np.abs(rotations - rotations_of(row)).max() < 1e-6
        there = places_of(rotations.astype(float), np.array(seen["hips"]), np.array(seen["shifts"]).reshape(-1, 3), skeleton)
        assert np.abs(there - joints.position).max() < 1e-3
        assert seen["who"] == n and seen["talks"] == (n == 0) and seen["face"] == row["face"].tolist()

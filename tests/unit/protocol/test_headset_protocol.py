"""What the headset of a guest's page measures, what the page makes of it (clients/web/join/poses.ts, in node), and anything else
that might arrive in its place."""

from __future__ import annotations

import base64
import json
import math
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzzing import Case, fuzz, pieces, variants
from hypothesis import given

from vistel.figure.posture.posture import pose_joints, standing
from vistel.figure.skeleton import standard_skeleton
from vistel.protocol.pages.headset import (
    JOINTS,
    LARGEST_M,
    MOST_BYTES,
    MOST_LATE_NS,
    PARENTS,
    TURN,
    UNIT_M,
    Controller,
    HeadsetDecoder,
    TrackedHand,
    headset_of,
    headset_record,
)
from vistel_sim.pages.headset import joints_of_hand

NOW_NS = 10**18
SKELETON = standard_skeleton(1.75)
AHEAD = np.array((0.25, 1.1, 0.35))
EYES, LOOKS = (0.01, 1.19, 0.02), (0.0, 1.0, 0.0, 0.0)


def hand(side: str = "left") -> TrackedHand:
    """A hand before the chest."""
    at = joints_of_hand(side, SKELETON, pose_joints(SKELETON, standing()))
    x, y, z = (at - at[0]).T
    return TrackedHand([tuple(map(float, p)) for p in np.column_stack((x, y, z)) + AHEAD * (1 if side == "left" else -1, 1, 1)])


LEFT, RIGHT = hand(), hand("right")
HELD = Controller((-0.2, 1.0, 0.4), (0.5, 0.5, -0.5, 0.5), 0.25, 1.0, 0.5)
RECORD = headset_record(NOW_NS, EYES, LOOKS, LEFT, RIGHT)
CONTROLLERS = headset_record(NOW_NS, EYES, LOOKS, HELD, HELD)
HEAD, POSE, WRIST = 12, 15, 7
"""Bytes of parts."""


def test_a_record_says_what_was_measured_and_is_small() -> None:
    (frame,) = HeadsetDecoder("ann-headset").feed(RECORD, NOW_NS + 5)
    assert (frame.device, frame.header.t_ns, frame.confidence) == ("ann-headset", NOW_NS + 5, 255)
    assert abs(frame.poses_t_ns - NOW_NS) < 1000
    assert list(frame.head) == [100, 11900, 200, 0, TURN, 0, 0]
    for told, told_by in ((frame.left, LEFT), (frame.right, RIGHT)):
        off = np.reshape(told.joints, (JOINTS, 3)) * UNIT_M - np.array(told_by.joints)
        assert np.abs(off).max() < 0.0004, "no error adds up from joint to joint"
    assert len(RECORD) == MOST_BYTES and MOST_BYTES * 8 * 30 < 67_000  # with a voice of 29 kbit/s below 96


def test_a_controller_is_a_pose_and_two_buttons() -> None:
    (frame,) = HeadsetDecoder("d").feed(headset_record(NOW_NS, EYES, LOOKS, right=HELD), NOW_NS)
    assert not frame.HasField("left") and not frame.right.joints
    assert list(frame.right.grip) == [-2000, 10000, 4000, *(round(q * TURN) for q in HELD.turn)]
    assert (frame.right.trigger, frame.right.squeeze, frame.right.confidence) == (64, 255, 128)


def test_a_headset_that_is_not_worn_says_so() -> None:
    (frame,) = HeadsetDecoder("d").feed(headset_record(NOW_NS, None), NOW_NS)
    assert not frame.head and not frame.HasField("left") and not frame.HasField("right")


def put(record: bytes, at: int, data: bytes) -> bytes:
    """A record with other bytes in one place."""
    return record[:at] + data + record[at + len(data) :]


@pytest.mark.parametrize(
    "record",
    [
        RECORD[:-1],  # a joint too few
        RECORD + bytes(3),  # one too many
        b"VQ" + RECORD[2:],
        put(RECORD, 3, b"\xff"),  # parts that there are not
        put(RECORD, 3, b"\x1e"),  # hands of nobody
        put(RECORD, 3, b"\x09"),  # joints of a hand that is not there
        put(RECORD, 4, struct.pack("<d", float("nan"))),
        put(RECORD, 4, struct.pack("<d", float("inf"))),
        put(RECORD, 4, struct.pack("<d", 1e9)),
        headset_record(NOW_NS + 3_600_000_000_000, EYES, LOOKS),
        headset_record(NOW_NS - MOST_LATE_NS - 10**9, EYES, LOOKS),
        put(RECORD, HEAD + 1, struct.pack("<h", 32767)),  # a head 3 m aside
        put(RECORD, HEAD + 3, struct.pack("<h", -1)),  # under the floor
        put(RECORD, HEAD + 7, struct.pack("<4h", 0, 0, 0, 0)),  # turned by nothing at all
        put(RECORD, HEAD + 7, struct.pack("<4h", *[TURN] * 4)),  # by a rotation of length 2
        put(RECORD, HEAD + 7, struct.pack("<4h", 0, round(0.95 * TURN), 0, 0)),
        put(RECORD, HEAD + POSE + 1, struct.pack("<h", 32767)),  # a hand 3 m aside
        put(RECORD, HEAD + POSE + 1, struct.pack("<3h", 15000, 1000, -15000)),  # near the seat, farther than an arm from the head
        put(RECORD, HEAD + POSE + WRIST, b"\x7f" * 72),  # fingers half a metre long
        put(RECORD, HEAD + POSE + WRIST, bytes(72)),  # a hand without size
        put(CONTROLLERS, HEAD + POSE + 7, struct.pack("<4h", *[TURN] * 4)),
        put(CONTROLLERS, HEAD + POSE + 1, struct.pack("<h", -32768)),
        CONTROLLERS[:-1],
        b"VP\x09",
        b"",
    ],
)
def test_a_page_cannot_say_what_no_headset_measures(record: bytes) -> None:
    assert headset_of(record, NOW_NS) is None


@fuzz
@given(pieces(RECORD, CONTROLLERS, RECORD[:12], RECORD[12:27], RECORD[27:], headset_record(NOW_NS, None), struct.pack("<d", 1e300)))
def test_fuzz_any_bytes_give_only_poses_of_somebody_on_the_seat_and_the_next_is_read(case: Case) -> None:
    for packet in variants(case):
        decoder = HeadsetDecoder("d")
        for frame in decoder.feed(packet, NOW_NS):
            assert len(frame.head) in (0, 7) and all(abs(x) <= 32767 for x in frame.head)
            for told in (frame.left, frame.right):
                assert len(told.joints) in (0, 3 * JOINTS) and len(told.grip) in (0, 7)
                away = [math.dist(told.joints[n : n + 3], told.joints[:3]) * UNIT_M for n in range(0, len(told.joints), 3)]
                assert all(length <= LARGEST_M for length in away)
        assert len(decoder.feed(RECORD, NOW_NS)) == 1


WEB = Path(__file__).resolve().parents[3] / "clients/web"
_RUN = """
import { readFileSync } from "node:fs";
import { parentOf, record } from "./poses.mjs";
const told = JSON.parse(readFileSync(0, "utf-8"), (_, x) => (x === "NaN" ? NaN : x === "1e9" ? 1e9 : x));
const records = told.map(({ head, left, right }) => {
  const data = record(head, left, right);
  new DataView(data).setFloat64(4, 1e12, true);
  return Buffer.from(data).toString("base64");
});
console.log(JSON.stringify({ records, parents: Array.from({ length: 25 }, (_, n) => parentOf(n)) }));
"""


@pytest.fixture
def page(tmp_path: Path) -> Any:
    """What the page makes of measurements: records, and the joint before each."""
    node, esbuild = shutil.which("node"), WEB / "node_modules/.bin/esbuild"
    if node is None or not esbuild.is_file():
        pytest.skip("node or clients/web/node_modules is not there (make web)")
    out = tmp_path / "poses.mjs"
    subprocess.run([esbuild, "join/poses.ts", "--format=esm", f"--outfile={out}"], cwd=WEB, check=True, capture_output=True)
    (tmp_path / "run.mjs").write_text(_RUN)

    def made(told: list[dict[str, Any]]) -> dict[str, Any]:
        done = subprocess.run([node, "run.mjs"], cwd=tmp_path, input=json.dumps(told), capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return made


def as_told(place: Any = EYES, turn: Any = LOOKS, **more: Any) -> dict[str, Any]:
    return {"place": list(place), "turn": list(turn), "confidence": 1.0, **more}


def test_the_driver_reads_what_the_page_writes(page: Any) -> None:
    held = as_told(HELD.place, HELD.turn, trigger=HELD.trigger, squeeze=HELD.squeeze) | {"confidence": HELD.confidence}
    seen = [{"joints": [list(p) for p in h.joints], "confidence": 1.0} for h in (LEFT, RIGHT)]
    made = page(
        [
            {"head": as_told(), "left": seen[0], "right": seen[1]},
            {"head": as_told(), "left": held, "right": held},
            {"head": None, "left": seen[0], "right": None},
        ]
    )
    assert tuple(made["parents"]) == PARENTS
    for record, ours in zip(made["records"], (RECORD, CONTROLLERS, headset_record(NOW_NS, None)), strict=True):
        read, wanted = (headset_of(data, NOW_NS) for data in (base64.b64decode(record), ours))
        assert read is not None and wanted is not None
        assert list(read.head) == list(wanted.head) and read.confidence == wanted.confidence
        for a, b in ((read.left, wanted.left), (read.right, wanted.right)):
            # What lies in the middle between two numbers may be either.
            assert np.allclose(a.joints, b.joints, atol=8) and np.allclose(a.grip, b.grip, atol=1)
            assert (a.confidence, a.trigger, a.squeeze) == (b.confidence, b.trigger, b.squeeze)


def test_a_page_whose_headset_measures_nonsense_leaves_it_out_and_is_not_refused(page: Any) -> None:
    few = {"joints": [list(p) for p in LEFT.joints[:-1]], "confidence": 1.0}
    broken = {"joints": [["NaN", 1.0, 0.3], *map(list, LEFT.joints[1:])], "confidence": 1.0}
    stretched = {"joints": [*map(list, LEFT.joints[:-1]), ["1e9", 1.0, 0.3]], "confidence": 1.0}
    heads = [as_told(("NaN", 1.2, 0)), as_told(("1e9", 1.2, 0)), as_told(turn=(1, 1, 1, 1)), as_told(turn=(0, "NaN", 0, 0))]
    told = [{"head": head, "left": None, "right": None} for head in heads]
    told += [{"head": as_told(), "left": wrong, "right": None} for wrong in (few, broken, stretched)]
    told.append({"head": as_told(), "left": None, "right": as_told(("1e9", 0, 0), trigger="NaN", squeeze="1e9")})
    for n, record in enumerate(page(told)["records"]):
        frame = headset_of(base64.b64decode(record), NOW_NS)
        assert (
            frame is not None
            and bool(frame.head) == (n >= len(heads))
            and not frame.HasField("left")
            and not frame.HasField("right")
        )

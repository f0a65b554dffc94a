"""Any bytes at all, a hundred thousand times each: parsers neither fail nor invent, and find the next record.

Hypothesis draws what is spliced and a seed; each drawn case is cut, spliced and flipped in many ways.
"""

from __future__ import annotations

import math
import os
import random
import struct
from collections.abc import Callable, Iterator, Sequence

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vistel.protocol import vmc
from vistel.protocol.fivedt import Glove5Parser, Glove16Parser, ReportParser, UltraParser
from vistel.protocol.fivedt_calibration import default_calibration
from vistel.protocol.liberty import LibertyParser
from vistel.protocol.live_link_face import FacePacket, encode, parse

VARIANTS = 500
CASES = max(1, int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "100000")) // VARIANTS)
fuzz = settings(
    max_examples=CASES, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow]
)

LIBERTY = b"LY\x02C \0\x22\0" + struct.pack("<7fI", 12.0, -3.5, 40.0, 0.8, 0.0, 0.6, 0.0, 77) + b"\r\n"
WHO = b"LY\0\x16 \0\x10\0Polhemus LIBERTY"
ULTRA = b"<\x02\x01" + bytes(range(100, 124)) + b"\0>"
SIXTEEN = b"<D" + struct.pack(">16H", *range(1000, 1016)) + b"\0>"
FIVE = b"\x80\x10\x20\x30\x40\x50\x60\x70\x00"


def pieces(*known: bytes) -> st.SearchStrategy[tuple[list[bytes], int]]:
    some = st.one_of(st.sampled_from(known), st.binary(max_size=24))
    return st.tuples(st.lists(some, max_size=6), st.integers(0, 2**32))


def variants(case: tuple[list[bytes], int]) -> Iterator[bytes]:
    """The pieces in other orders, cut, with bytes changed."""
    parts, seed = case
    rng = random.Random(seed)
    yield b"".join(parts)
    for _ in range(VARIANTS - 1):
        picked = [p[rng.randrange(len(p) + 1) :] if rng.random() < 0.3 else p for p in parts if rng.random() < 0.8]
        rng.shuffle(picked)
        out = bytearray(b"".join(picked))
        for _ in range(rng.randrange(3)):
            if out:
                out[rng.randrange(len(out))] = rng.randrange(256)
        yield bytes(out)


def check(parser: object, record: bytes, garbage: bytes, sound: Callable[[object], bool]) -> None:
    """What is found is sound; of three records after the garbage at least the last two are found."""
    feed: Callable[[bytes, int], Sequence[object]] = parser.feed  # type: ignore[attr-defined]
    third = len(garbage) // 3
    found = [*feed(garbage[:third], 10**9), *feed(garbage[third:], 2 * 10**9)]
    assert all(map(sound, found))
    after = [feed(record, 3 * 10**9 + k) for k in range(3)]
    assert sum(map(len, after)) >= 2
    assert len(after[2]) == 1 and sound(after[2][0])


def true_pose(r) -> bool:
    near = all(math.isfinite(x) and abs(x) <= 15.0 for x in r.position)
    return near and abs(math.hypot(*r.rotation) - 1.0) < 1e-9 and 1 <= r.station <= 16 and len(r.error) <= 1


def true_sample(count: int, highest: int) -> Callable[[object], bool]:
    hand = default_calibration(highest)

    def sound(s) -> bool:
        whole = len(s.values) == count and all(0 <= v <= highest for v in s.values)
        return whole and all(map(math.isfinite, hand.angles(s.values, 5 if count == 5 else 14)))

    return sound


@fuzz
@given(pieces(b"L", b"LY", b"PA\1", b"\0\x16", b"\x22\0", b" ", LIBERTY[:8], LIBERTY[:30], LIBERTY[9:], LIBERTY, WHO, WHO[:9]))
def test_liberty_gives_only_true_poses_and_is_back_within_two_records(case: tuple[list[bytes], int]) -> None:
    for garbage in variants(case):
        check(LibertyParser(), LIBERTY, garbage, true_pose)


@fuzz
@given(pieces(b"<", b">", b"\x02", b"<\x02\1", ULTRA, ULTRA[:20], ULTRA[9:]))
def test_ultra_gives_only_whole_samples_and_is_back_within_two(case: tuple[list[bytes], int]) -> None:
    sound = true_sample(16, 4095)
    for garbage in variants(case):
        check(UltraParser(), ULTRA, garbage, sound)


@fuzz
@given(pieces(b"<", b">", b"<D", b"<I", b"\3", SIXTEEN, SIXTEEN[:20], SIXTEEN[9:]))
def test_data_glove_16_gives_only_whole_samples_and_is_back_within_two(case: tuple[list[bytes], int]) -> None:
    sound = true_sample(16, 4095)
    for garbage in variants(case):
        check(Glove16Parser(), SIXTEEN, garbage, sound)


@fuzz
@given(pieces(b"\x80", b"\x55", b"BR", b"B", b"\1", FIVE, FIVE[:5], FIVE[3:]))
def test_data_glove_5_gives_only_whole_samples_and_is_back_within_two(case: tuple[list[bytes], int]) -> None:
    sound = true_sample(5, 255)
    for garbage in variants(case):
        check(Glove5Parser(), FIVE, garbage, sound)


@fuzz
@given(pieces(struct.pack(">16H", *range(16)).ljust(64, b"\0"), bytes(32), b"\x0f\xff"))
def test_hid_reports_fuzz_gives_only_whole_samples(case: tuple[list[bytes], int]) -> None:
    sound = true_sample(16, 4095)
    for report in variants(case):
        assert all(map(sound, ReportParser().feed(report, 1)))


FACE = encode(FacePacket("id", "Ann", 7, 0.25, (60, 1), (0.5,) * 61))


@fuzz
@given(pieces(FACE, FACE[:20], FACE[20:40], FACE[40:], b"\x06", b"\0\0\0\x02", b"\x3d"))
def test_live_link_fuzz_gives_only_finite_faces(case: tuple[list[bytes], int]) -> None:
    for packet in variants(case):
        face = parse(packet)
        if face is not None:
            assert len(face.values) in (0, 61) and all(map(math.isfinite, face.values))
    assert parse(FACE) is not None


BODY = vmc.encode({"Hips": ((0.0, 0.9, 0.0), (0.0, 0.0, 0.0, 1.0)), "Head": ((0.1, 0.2, 0.3), (0.6, 0.0, 0.0, 0.8))})


@fuzz
@given(pieces(BODY, BODY[:16], BODY[16:40], BODY[40:], b"#bundle\0", b"/VMC/Ext/Bone/Pos\0\0\0", b",sfffffff\0\0\0", b"Head\0"))
def test_vmc_fuzz_gives_only_true_poses_and_is_back_at_once(case: tuple[list[bytes], int]) -> None:
    for packet in variants(case):
        parser = vmc.VmcParser()
        bodies = [*parser.feed(packet, 1), *parser.feed(BODY, 2)]
        for body in bodies:
            for p, q in body.bones.values():
                assert all(math.isfinite(x) and abs(x) <= 20.0 for x in p) and abs(math.hypot(*q) - 1.0) < 1e-9
        assert bodies and bodies[-1].bones["Head"][0] == tuple(map(float, struct.unpack("3f", struct.pack("3f", 0.1, 0.2, 0.3))))

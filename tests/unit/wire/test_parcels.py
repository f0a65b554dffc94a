"""Large things in parts: put together in any order, and refused where they cannot be."""

from __future__ import annotations

import logging
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.v1.motion_pb2 import AvatarPart
from vistel.wire import parcels
from vistel.wire.parcels import MOST_BYTES, PART_BYTES, Parcels, digest_of, parts_of


@settings(max_examples=30, deadline=None)
@given(size=st.integers(1, 5 * PART_BYTES), seed=st.integers(0, 99))
def test_parts_in_any_order_and_doubled_give_the_parcel_once(size: int, seed: int) -> None:
    data, shuffled = random.Random(seed).randbytes(size), random.Random(seed)
    parts = [*parts_of(data), *parts_of(data)]
    shuffled.shuffle(parts)
    receiver = Parcels()
    whole = [w for name, part in parts if (w := receiver.take("tokyo", digest_of(data), name, part)) is not None]
    assert whole == [data]


def test_a_part_fits_between_motion() -> None:
    assert all(len(part.SerializeToString()) < 60_000 for _, part in parts_of(bytes(3 * PART_BYTES)))


def test_a_parcel_that_is_too_large_is_not_cut() -> None:
    with pytest.raises(ValueError, match=r"expected at most 16\.8 MB"):
        next(parts_of(bytes(MOST_BYTES + 1)))


@pytest.mark.parametrize(
    ("digest", "name", "part", "reason"),
    [
        ("0" * 32, "0000", AvatarPart(parts=1, size=4, data=b"none"), "another digest"),
        ("0" * 32, "0000", AvatarPart(parts=1, size=MOST_BYTES + 1, data=b"x"), "expected at most"),
        ("0" * 32, "0001", AvatarPart(parts=1, size=4, data=b"none"), "part 1 of 1"),
        ("0" * 32, "0000", AvatarPart(parts=9, size=4, data=b"none"), "part 0 of 9"),
        ("0" * 32, "0000", AvatarPart(parts=1, size=4, data=b"five5"), "has 5 bytes"),
        ("0" * 32, "x", AvatarPart(parts=1, size=4, data=b"none"), "part -1"),
        ("ann", "0000", AvatarPart(parts=1, size=4, data=b"none"), "no digest"),
    ],
)
def test_what_cannot_be_is_refused_with_one_line(
    digest: str, name: str, part: AvatarPart, reason: str, caplog: pytest.LogCaptureFixture
) -> None:
    receiver = Parcels()
    with caplog.at_level(logging.ERROR):
        assert receiver.take("tokyo", digest, name, part) is None
        assert receiver.take("tokyo", digest, name, part) is None
    assert [reason in r.getMessage() for r in caplog.records] == [True]
    assert ("tokyo", digest) in receiver.refused


def test_who_sends_rubbish_under_another_ones_digest_harms_only_themselves() -> None:
    data = b"an avatar" * 9000
    receiver = Parcels()
    names = list(parts_of(data))
    receiver.take("mallory", digest_of(data), names[0][0], AvatarPart(parts=2, size=len(data), data=b"x"))
    whole = [receiver.take("tokyo", digest_of(data), name, part) for name, part in names]
    assert whole == [None, data]


def test_what_waits_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parcels, "MOST_WAITING", 2 * PART_BYTES)
    receiver = Parcels()
    for k in range(3):
        name, part = next(parts_of(bytes([k]) * (2 * PART_BYTES)))
        receiver.take(f"site{k}", f"{k}" * 32, name, part)
    assert len(receiver.refused) == 1

"""Live Link Face packets, made here and recorded from a real phone."""

from __future__ import annotations

import csv
import gzip
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vistel.figure.face.marks import MARK_INDEX, MOVES, REST, Expressions
from vistel.protocol.live_link_face import CHANNELS, FacePacket, LiveLinkParser, encode, parse

PACKET = FacePacket("ABC", "Ann's phone", 99, 0.5, (60, 1), tuple(k / 100 for k in range(61)))


def recorded(path: Path) -> list[bytes]:
    data = gzip.decompress(path.read_bytes())
    (count,) = struct.unpack_from(">L", data, 1)
    at, out = 5, []
    for _ in range(count):
        (length,) = struct.unpack_from(">L", data, at)
        out.append(data[at + 4 : at + 4 + length])
        at += 4 + length
    return out


def test_a_packet_goes_there_and_back() -> None:
    again = parse(encode(PACKET))
    assert again is not None and replace(again, values=PACKET.values) == PACKET
    assert again.values == pytest.approx(PACKET.values)


def test_a_phone_that_sees_no_face_sends_no_values() -> None:
    packet = parse(encode(replace(PACKET, values=())))
    assert packet is not None and packet.values == ()


@pytest.mark.parametrize(
    "bad",
    [
        b"",
        b"\x05",
        encode(PACKET)[:-1],
        encode(PACKET) + b"x",
        encode(replace(PACKET, rate=(60, 0))),
        encode(replace(PACKET, values=(float("nan"),) * 61)),
        encode(replace(PACKET, values=(1e9,) * 61)),
        b"\x06\xff\xff\xff\xff" + bytes(300),
    ],
)
def test_what_is_no_packet_is_none(bad: bytes) -> None:
    assert parse(bad) is None


def test_a_second_phone_on_the_same_port_is_left_out_until_the_first_falls_silent() -> None:
    parser = LiveLinkParser()
    other = encode(replace(PACKET, device="DEF"))
    assert len(parser.feed(encode(PACKET), 10**9)) == 1
    assert parser.feed(other, 10**9 + 1) == [] and parser.bytes_skipped == len(other)
    assert len(parser.feed(other, 3 * 10**9)) == 1


def test_a_real_phones_packets_read_as_their_csv_says(shared_data: Path) -> None:
    packets = [parse(p) for p in recorded(shared_data / "face/arkit/dao_000_107.gesichter")]
    with (shared_data / "face/arkit/dao_000_107.csv").open() as f:
        rows = list(csv.DictReader(f))
    assert len(packets) == len(rows) == 108
    names = {name.lower(): name for name in rows[0]}
    for packet, row in zip(packets, rows, strict=True):
        assert packet is not None and packet.frame == int(row["FrameNumber"])
        want = [float(row[names[c.lower()]]) for c in CHANNELS]
        assert packet.values == pytest.approx(want, abs=1e-5)


def test_a_sweep_of_every_channel_is_read(shared_data: Path) -> None:
    expressions = Expressions(CHANNELS)
    for data in recorded(shared_data / "face/arkit/debug-all-blendshapes.gesichter"):
        packet = parse(data)
        assert packet is not None and len(packet.values) == 61
        assert np.isfinite(expressions.marks(packet.values)).all()


def test_a_neutral_face_rests_and_a_smile_lifts_the_corners_alike() -> None:
    expressions = Expressions(CHANNELS)
    assert np.array_equal(expressions.marks([0.0] * 61), REST)
    smile = dict.fromkeys(CHANNELS, 0.0) | {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0}
    moved = expressions.marks(list(smile.values())) - REST
    left, right = moved[MARK_INDEX["left_mouth_corner"]], moved[MARK_INDEX["right_mouth_corner"]]
    assert left[1] > 0.005 and left[0] > 0.0 and left == pytest.approx((-right[0], right[1]))
    assert set(MOVES) <= set(CHANNELS)


def test_both_eyes_to_the_left_and_up_is_positive_gaze() -> None:
    look = dict.fromkeys(CHANNELS, 0.0)
    look |= {"eyeLookOutLeft": 1.0, "eyeLookInRight": 1.0, "eyeLookUpLeft": 0.5, "eyeLookUpRight": 0.5}
    yaw, pitch = Expressions(CHANNELS).gaze(list(look.values()))
    assert yaw == pytest.approx(np.radians(35)) and pitch == pytest.approx(np.radians(14))

"""The simulated FASTRAK does what the manual says, without a port."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from vistel.protocol.fastrak import FastrakParser
from vistel_sim.fastrak import Fastrak

TRUTH = {
    1: ((0.50, 0.10, -0.60), (0.0, 0.0, 0.0, 1.0)),
    2: ((0.40, -0.10, -0.90), (0.0, 0.0, math.sin(0.3), math.cos(0.3))),
    3: ((0.60, -0.30, -0.40), (math.sin(0.2), 0.0, 0.0, math.cos(0.2))),
    4: ((0.60, 0.30, -0.40), (0.0, math.sin(-0.1), 0.0, math.cos(-0.1))),
}


def unit(**options: float) -> Fastrak:
    quiet = {"position_noise": 0.0, "angle_noise": 0.0} | options
    return Fastrak(lambda station, t_s: TRUTH[station], **quiet)  # type: ignore[arg-type]


def said(fastrak: Fastrak, command: bytes, t_s: float = 0.0) -> bytes:
    return b"".join(r.data for r in fastrak.receive(command, t_s))


def records(fastrak: Fastrak, count: int) -> list[bytes]:
    out: list[bytes] = []
    while len(out) < count and fastrak.next_length():
        length = fastrak.next_length()
        out.append(fastrak.measure(len(out) / 120.0))
        assert len(out[-1]) == length
    return out


def test_it_wakes_up_polled_in_inches_and_text() -> None:
    fastrak = unit()
    assert fastrak.next_length() == 0
    assert said(fastrak, b"P") == b""
    first = records(fastrak, 9)
    assert len(first) == 4  # one of every active station, then silence
    assert first[0] == b"01   19.69   3.94 -23.62   0.00   0.00   0.00\r\n"
    assert len(first[0]) == 47


def test_stations_take_turns_and_c_stops_them() -> None:
    fastrak = unit()
    said(fastrak, b"C")
    assert [r[1:2] for r in records(fastrak, 6)] == [b"1", b"2", b"3", b"4", b"1", b"2"]
    said(fastrak, b"c")
    assert fastrak.next_length() == 0


def test_a_disabled_station_loses_its_turn() -> None:
    fastrak = unit()
    said(fastrak, b"l2,0\rl4,0\rC")
    assert [r[1:2] for r in records(fastrak, 4)] == [b"1", b"3", b"1", b"3"]
    assert said(fastrak, b"l1\r") == b"21l1010\r\n"


def test_binary_centimetres_are_what_the_driver_reads() -> None:
    fastrak = unit()
    said(fastrak, b"".join(b"O%d,2,11,1\r" % n for n in (1, 2, 3, 4)) + b"H1,0,0,-1\ruf" + b"C")
    parser = FastrakParser()
    out = [r for data in records(fastrak, 4) for r in parser.feed(data, 10**9)]
    for r in out:
        position, rotation = TRUTH[r.station]
        assert r.position == pytest.approx(position, abs=1e-6)
        assert abs(np.dot(r.rotation, rotation)) == pytest.approx(1.0, abs=1e-6)
    assert [r.station for r in out] == [1, 2, 3, 4] and parser.bytes_skipped == 0


def test_records_in_the_form_other_readers_ask_for() -> None:
    fastrak = unit()
    said(fastrak, b"O1,2,11,0\rO2,52,61,50\nfC")
    a, b = records(fastrak, 2)
    assert len(a) == 32 and a.endswith(b" ") and len(b) == 32
    assert struct.unpack("<3f", a[3:15]) == pytest.approx([x / 0.0254 for x in TRUTH[1][0]], rel=1e-6)
    assert struct.unpack("<4f", b[15:31]) == pytest.approx((math.cos(0.3), 0.0, 0.0, math.sin(0.3)), abs=1e-6)


def test_every_item_has_the_manuals_length() -> None:
    lengths = {2: (21, 12), 3: (21, 12), 4: (21, 12), 5: (21, 12), 11: (28, 16), 52: (39, 12), 61: (52, 16), 0: (1, 1)}
    for item, (text, binary) in lengths.items():
        fastrak = unit()
        said(fastrak, b"O1,%d\rC" % item)
        assert len(records(fastrak, 1)[0]) == 3 + text
        said(fastrak, b"f")
        records(fastrak, 3)
        assert len(records(fastrak, 1)[0]) == 3 + binary


def test_settings_survive_a_stop_and_several_commands_come_in_one_read() -> None:
    fastrak = unit()
    said(fastrak, b"O1,2,1\rufCcC")
    (r, *_) = records(fastrak, 1)
    assert len(r) == 3 + 12 + 2 and struct.unpack("<f", r[3:7]) == pytest.approx([50.0])


def test_a_command_may_come_in_pieces() -> None:
    fastrak = unit()
    assert said(fastrak, b"H") + said(fastrak, b"1") == b""
    assert said(fastrak, b"\r") == b"21H   1.00   0.00   0.00\r\n"


def test_status_is_55_bytes_and_tells_the_modes() -> None:
    fastrak = unit()
    assert said(fastrak, b"S")[:6] == b"21S3F0" and len(said(fastrak, b"S")) == 55
    said(fastrak, b"uf")
    assert said(fastrak, b"S")[3:6] == b"3F3"


@pytest.mark.parametrize(
    ("command", "code"), [(b"O1,99\r", b"-3"), (b"H1,x\r", b"-2"), (b"l9,1\r", b"-3"), (b"O\r", b"-1"), (b"?", b"-99")]
)
def test_a_wrong_command_is_refused(command: bytes, code: bytes) -> None:
    reply = said(unit(), command)
    assert reply.startswith(b"2 E*ERROR*") and b" EC " + code + b" " in reply and reply.endswith(b"\r\n")


def test_a_receiver_on_the_wrong_side_is_seen_mirrored() -> None:
    fastrak = unit()
    said(fastrak, b"H1,0,0,1\rO1,2,1\ruC")
    assert records(fastrak, 1)[0][3:24] == b" -50.00 -10.00  60.00"


def test_euler_angles_turn_about_z_then_y_then_x() -> None:
    fastrak = Fastrak(
        lambda station, t_s: ((0.5, 0.0, 0.0), (0.0, 0.0, math.sin(math.radians(15)), math.cos(math.radians(15)))),
        position_noise=0.0,
        angle_noise=0.0,
    )
    said(fastrak, b"O1,4,1\rC")
    assert records(fastrak, 1)[0][3:24] == b"  30.00   0.00   0.00"


def test_boresight_makes_the_attitude_the_reference() -> None:
    fastrak = unit()
    said(fastrak, b"O2,4,1\rl1,0\rB2\rC")
    assert records(fastrak, 1)[0][3:24].replace(b"-0.00", b" 0.00") == b"   0.00   0.00   0.00"
    said(fastrak, b"b2\r")
    records(fastrak, 2)
    assert abs(float(records(fastrak, 1)[0][3:10]) - math.degrees(0.6)) < 0.01


def test_an_alignment_frame_moves_the_origin() -> None:
    fastrak = unit()
    said(fastrak, b"uA1,10,0,0,10,1,0,9,0,0\rO1,2,1\rC")  # new +X along old +Y, new +Y along old -X
    assert records(fastrak, 1)[0][3:24] == b"  10.00 -40.00 -60.00"
    said(fastrak, b"R1\rl2,0\rl3,0\rl4,0\r")
    assert records(fastrak, 1)[0][3:24] == b"  50.00  10.00 -60.00"


def test_restart_is_deaf_for_a_while_and_forgets() -> None:
    fastrak = unit(restart_s=2.0)
    said(fastrak, b"uf\x19", 5.0)
    assert said(fastrak, b"S", 6.9) == b""
    assert said(fastrak, b"S", 7.1)[3:6] == b"3F0"


def test_saved_settings_outlive_a_restart() -> None:
    fastrak = unit(restart_s=0.0)
    said(fastrak, b"uf\x0b")
    said(fastrak, b"UF\x19", 1.0)
    assert said(fastrak, b"S", 2.0)[3:6] == b"3F3"


def test_noise_is_the_units_static_accuracy() -> None:
    fastrak = Fastrak(lambda station, t_s: TRUTH[1], seed=3)
    said(fastrak, b"O1,2,11,1\rl2,0\rl3,0\rl4,0\rufC")
    parser = FastrakParser()
    out = [r for data in records(fastrak, 3000) for r in parser.feed(data, 10**9)]
    errors = np.array([r.position for r in out]) - TRUTH[1][0]
    assert errors.std(axis=0) == pytest.approx([0.0008] * 3, rel=0.1)
    angles = 2 * np.degrees(np.linalg.norm([r.rotation[:3] for r in out], axis=1))
    assert math.sqrt((angles**2).mean() / 3) == pytest.approx(0.15, rel=0.1)


def test_the_same_seed_says_the_same() -> None:
    def speak(seed: int) -> list[bytes]:
        fastrak = Fastrak(lambda station, t_s: TRUTH[station], seed=seed)
        said(fastrak, b"C")
        return records(fastrak, 8)

    assert speak(1) == speak(1) != speak(2)


def test_metal_makes_it_read_elsewhere() -> None:
    error = np.array([0.02, 0.0, -0.01, 0.0, 0.0, 0.1])
    units = [
        Fastrak(lambda station, t: ((0.3, 0.2, -0.4), (0.0, 0.0, 0.0, 1.0)), position_noise=0.0, angle_noise=0.0, metal=metal)
        for metal in (None, lambda p: error)
    ]
    parser = [FastrakParser(), FastrakParser()]
    clean, off = (
        (u.receive(b"O1,2,11,1\rH1,0,0,-1\rufC", 0.0), p.feed(u.measure(0.1), 10**9))[1][0]
        for u, p in zip(units, parser, strict=True)
    )
    assert np.subtract(off.position, clean.position) == pytest.approx(error[:3], abs=1e-5)
    assert off.rotation == pytest.approx((0.0, 0.0, np.sin(0.05), np.cos(0.05)), abs=1e-5)


def first(fastrak: Fastrak) -> bytes:
    """A record of the first station, whose turn comes at last."""
    return next(r for r in records(fastrak, 8) if r[1:2] == b"1")


@pytest.mark.parametrize(
    ("command", "record"),
    [
        (b"r1,90,0,0\r", b" -10.00  50.00 -60.00"),  # the transmitter turned about its Z
        (b"N1,5,0,0\r", b"  55.00  10.00 -60.00"),  # the tip is farther along the receiver's X
        (b"A1,10,0,0,11,0,0,10,1,0\r", b"  40.00  10.00 -60.00"),
        (b"A1,10,0,0,11,0,0,10,1,0\rR1\r", b"  50.00  10.00 -60.00"),
        (b"H1,0,0,1\r", b" -50.00 -10.00  60.00"),
    ],
)
def test_commands_that_move_what_is_read(command: bytes, record: bytes) -> None:
    fastrak = unit()
    said(fastrak, b"uO1,2,1\r" + command + b"C")
    assert first(fastrak)[3:24] == record


@pytest.mark.parametrize(
    ("command", "letter"),
    [
        (b"V1,60,20,0,40,0,-70\r", b" "),
        (b"V1,40,20,0,30,0,-70\r", b"x"),
        (b"Q1,10,10,10,-10,-10,-10\r", b" "),
        (b"Q1,-5,10,10,-10,-10,-10\r", b"y"),
    ],
)
def test_envelopes_are_named_by_a_letter_and_the_pose_is_sent(command: bytes, letter: bytes) -> None:
    fastrak = unit()
    said(fastrak, b"uO1,2,1\r" + command + b"C")
    assert first(fastrak)[2:3] == letter and len(first(fastrak)) == 26


def test_an_increment_holds_records_back_until_the_receiver_has_moved() -> None:
    fastrak = Fastrak(lambda station, t: ((0.3 + 0.01 * t, 0.0, -0.4), TRUTH[1][1]), position_noise=0.0, angle_noise=0.0)
    said(fastrak, b"uO1,2,1\rI1,2\rl2,0\rl3,0\rl4,0\rC")
    sent = [t for t in range(20) if fastrak.measure(float(t))]
    assert sent == [0, 2, 4, 6, 8, 10, 12, 14, 16, 18]


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        (b"S", b"21S3F0"),
        (b"l1\r", b"21l1111\r\n"),
        (b"O1\r", b"21O 2 4 1\r\n"),
        (b"H1\r", b"21H   1.00   0.00   0.00\r\n"),
        (b"G1\r", b"21G   0.00   0.00   0.00\r\n"),
        (b"G1,5,6,7\rG1\r", b"21G   5.00   6.00   7.00\r\n"),
        (b"r1\r", b"21r   0.000   0.000   0.000\r\n"),
        (b"A1\r", b"21A   0.00   0.00   0.00"),
        (b"y\r", b"2 y0\r\n"),
        (b"y1\ry\r", b"2 y1\r\n"),
        (b"X\r", b"2 XOutputCompensat"),
        (b"Xhall\rX\r", b"2 Xhall "),
        (b"T\r", b"2 T  0 no errors\r\n"),
        (b"x2\rv.2,.2,.8,.95\re1,0\rI1,0\rB1\rb1\rD\x13\x11d", b""),
        (b"DS", b"21S3F4"),
        (b"ufS", b"21S3F3"),
        (b"ufCWS", b"21S3F0"),
    ],
)
def test_every_command_of_the_manual_is_understood(command: bytes, reply: bytes) -> None:
    assert said(unit(), command).startswith(reply)
    assert b"E*ERROR*" not in said(unit(), command)


def test_suspended_output_resumes() -> None:
    fastrak = unit()
    said(fastrak, b"C\x13")
    assert fastrak.next_length() == 0
    said(fastrak, b"\x11")
    assert fastrak.next_length() == 47


def test_the_port_changes_its_speed_at_once() -> None:
    assert [r.baud for r in unit().receive(b"o384,N,8,0\r", 0.0)] == [38400]
    assert b"EC -3" in said(unit(), b"o500\r")

"""5DT gloves: their bytes, and the hand their counts mean."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import pytest

from vistel.protocol.fivedt import SLOTS, Glove5Parser, Glove16Parser, ReportParser, UltraParser, product_is
from vistel.protocol.fivedt_calibration import calibrate, default_calibration, load_calibration, save_calibration
from vistel.protocol.glove_calibration import GloveCalibrationError
from vistel_sim.fivedt import Glove5, Glove16, Ultra, UltraReports

HAND = [0.0, 0.5, 0.4, 0.6, 0.5, 0.1, 0.8, 1.6 / 3, 0.6, 0.0, 0.9, 0.6, 0.7, -0.05, 1.0, 2 / 3, 0.8, -0.15, 1.1, 2.2 / 3]


def test_twelve_bit_values_are_unpacked_high_nibble_first() -> None:
    values = tuple(range(0x123, 0x123 + 16))
    packed = int("".join(f"{v:03x}" for v in values), 16).to_bytes(24, "big")
    (s,) = UltraParser().feed(b"<\x03\x01" + packed + b"\x00>", 10**9)
    assert s.values == values and s.right is False and s.port == 0


def test_two_gloves_of_a_wireless_kit_are_told_apart() -> None:
    a, b = UltraParser().feed(b"<\x02\x01" + bytes(24) + b"\0><\x07\x01" + bytes(24) + b"\0>", 10**9)
    assert (a.right, a.port, b.right, b.port) == (True, 0, False, 1)


def test_a_data_glove_16_says_its_hand_in_its_info() -> None:
    data = b"<D" + struct.pack(">16H", *range(16)) + b"\0>"
    parser = Glove16Parser()
    assert parser.feed(data, 1)[0].right is None
    assert parser.feed(b"<I\2\1\1\1>" + data, 2)[0].right is True
    assert parser.bytes_skipped == 0


def test_a_data_glove_5_record_with_a_wrong_checksum_is_no_record() -> None:
    parser = Glove5Parser()
    assert parser.feed(b"\x80\x01\x02\x03\x04\x05\x06\x07\x01", 1) == []
    assert parser.feed(b"\x80\x01\x02\x03\x04\x05\x06\x07\x00", 1)[0].values == (1, 2, 3, 4, 5)


def test_products_are_known_by_their_bits() -> None:
    assert product_is(0x0000, right=True, sensors=14) and product_is(0x0001, right=False, sensors=14)
    assert product_is(0x0010, right=True, sensors=5) and product_is(0x0003, right=False, sensors=14)
    assert not product_is(0x0001, right=True, sensors=14) and not product_is(0x0010, right=True, sensors=14)


def test_fourteen_sensors_give_the_hand_back_and_end_joints_follow() -> None:
    c = default_calibration()
    assert c.angles([round(v) for v in c.counts(HAND, 14)], 14) == pytest.approx(HAND, abs=0.003)


def test_five_sensors_share_a_bend_between_joints() -> None:
    c = default_calibration()
    got = c.angles([round(v) for v in c.counts(HAND, 5)], 5)
    for base in (4, 8, 12, 16):
        assert got[base] + got[base + 2] == pytest.approx(HAND[base] + HAND[base + 2], abs=0.01)
        assert got[base + 3] == pytest.approx(2 / 3 * got[base + 2])
    assert got[5] == got[13] == got[17] == 0.0


@pytest.mark.parametrize("sensors", [14, 5])
def test_an_open_hand_and_a_fist_calibrate_a_user(sensors: int, tmp_path: Path) -> None:
    mine, notes = calibrate([900 + 10 * k for k in range(16)], [2600 - 5 * k for k in range(16)], default_calibration())
    assert notes == ()
    assert mine.open["thumb_near"] == 900 and mine.fist["little_far"] == 2600 - 65
    save_calibration(mine, tmp_path / "ann.json")
    assert load_calibration(tmp_path / "ann.json") == mine
    fist = mine.angles([round(mine.fist[n]) for n in SLOTS] + [0, 0], sensors)
    assert fist[4] == pytest.approx(math.radians(85)) and fist[6] == pytest.approx(math.radians(100))


def test_a_sensor_that_did_not_move_keeps_the_typical_hands() -> None:
    still = [1000.0, 0.0] * 8  # every other slot has no sensor
    found, notes = calibrate(still, still, default_calibration())
    assert found == default_calibration()
    assert [n.split()[0] for n in notes] == list(SLOTS[::2])


@pytest.mark.parametrize(
    "text", ["nonsense", '{"open": {"wrist": 1}}', '{"open": 3}', '{"open": {"thumb_near": 5}, "fist": {"thumb_near": 5}}']
)
def test_a_calibration_file_that_cannot_be_is_reported(text: str, tmp_path: Path) -> None:
    (tmp_path / "bad.json").write_text(text)
    with pytest.raises(GloveCalibrationError, match=r"bad\.json"):
        load_calibration(tmp_path / "bad.json")


@pytest.mark.parametrize(
    ("glove", "parser"), [(UltraReports, ReportParser), (Ultra, UltraParser), (Glove16, Glove16Parser), (Glove5, Glove5Parser)]
)
def test_simulated_gloves_say_what_the_hand_does(glove, parser) -> None:
    unit = glove(lambda t: HAND, noise=0.0, right=True)
    parser = parser()
    samples = [s for k in range(3) for s in parser.feed(unit.measure(k * 0.1), 10**9 + k)]
    highest = 255 if glove is Glove5 else 4095
    got = default_calibration(highest).angles(samples[-1].values, unit.sensors)
    assert got[4] + got[6] == pytest.approx(HAND[4] + HAND[6], abs=0.03)
    assert parser.bytes_skipped == 0

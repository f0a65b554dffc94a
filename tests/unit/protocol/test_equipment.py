"""Registers of a room's equipment: numbers and what they mean, reads put together."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.protocol.equipment import DELAY_UNIT, Block, Register, blocks


@pytest.mark.parametrize(
    ("register", "words", "value"),
    [
        (DELAY_UNIT["delay_1"], [2000], 0.2),
        (DELAY_UNIT["gain"], [0xFFE2], -3.0),
        (DELAY_UNIT["uptime"], [1, 2], 65538.0),
        (DELAY_UNIT["bypass_3"], [True], 1.0),
        (Register("holding", 7, "u16", 0.5, "%"), [80], 40.0),
    ],
)
def test_words_mean_values_and_values_become_the_same_words(register: Register, words: list[int], value: float) -> None:
    assert register.value(words) == pytest.approx(value)
    assert register.raw(value) == [int(w) for w in words]


@pytest.mark.parametrize(
    ("register", "value", "expected"),
    [
        (DELAY_UNIT["delay_1"], 2.5, "expected 0 to 2 s, got 2.5"),
        (DELAY_UNIT["gain"], 40.0, "expected -100 to 12 dB"),
        (Register("holding", 0), -1.0, "does not fit into a u16"),
        (Register("holding", 0, "i16"), 40_000.0, "does not fit into a i16"),
    ],
)
def test_what_a_register_cannot_hold_is_refused(register: Register, value: float, expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        register.raw(value)


@given(st.sampled_from([r for r in DELAY_UNIT.values() if r.kind != "bit"]), st.integers(0, 0xFFFF))
def test_every_count_of_a_register_survives_its_value(register: Register, count: int) -> None:
    words = [0, count] if register.kind == "u32" else [count]
    value = register.value(words)
    if (register.low is None or value >= register.low) and (register.high is None or value <= register.high):
        assert register.raw(value) == words


def test_a_delay_unit_is_read_in_four_questions() -> None:
    assert blocks(DELAY_UNIT) == [Block("holding", 0, 12), Block("input", 0, 32), Block("coil", 0, 16), Block("discrete", 0, 7)]


def test_far_registers_are_read_apart() -> None:
    far = {"a": Register("holding", 0), "b": Register("holding", 5), "c": Register("holding", 0x1000, "u32")}
    assert blocks(far) == [Block("holding", 0, 6), Block("holding", 0x1000, 2)]

"""In a crowd everybody has another body, and the world makes each once."""

from __future__ import annotations

from vistel.space.people import build_of

HEIGHTS = [1.4 + 0.005 * k for k in range(120)]


def test_the_bodies_of_a_hundred_different_people_are_made_once() -> None:
    made = [build_of(height, 1.0) for height in HEIGHTS]
    assert all(build_of(height, 1.0) is build for height, build in zip(HEIGHTS, made, strict=True))

"""The scenes of examples/ghosts do what they say."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np

EXAMPLES = Path(__file__).parents[3] / "examples/ghosts"


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_honey_hangs_draws_a_neck_lets_go_and_lands() -> None:
    scene = example("honey_drop")
    now = scene.room()
    gaps, heights = [], []
    for _ in range(27):
        now = now.step(1 / 30)
        gaps.append(now.holds()[0].gap if now.constraints else None)
        heights.append(float(now.position[2, 1]))
    drawn = [g for g in gaps if g is not None]
    assert len(drawn) >= 8  # it hangs for a quarter of a second at least
    assert all(np.diff(drawn) > 0)
    assert max(drawn) > 0.007
    assert gaps[-1] is None
    assert all(np.diff(heights[:15]) < 0)
    assert abs(heights[-1] - scene.RADIUS) < 0.01  # on the plate


def test_the_fly_gets_free_foot_by_foot() -> None:
    scene = example("fly_paper")
    now = scene.room()
    held = []
    for _ in range(30):
        now = scene.struggle(now, 1 / 30)
        held.append(sum(c.torn_at is None for c in now.constraints))
    assert held[0] == len(scene.FEET)
    assert held[-1] == 0
    assert all(np.diff(held) <= 0)
    assert len(set(held)) > 2
    assert now.position[1, 1] > 0.01

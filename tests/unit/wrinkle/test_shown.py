"""Wrinkles as arrays for shaders: channels, light, and the same weights as one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from avatar_fixture import closed_person
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.figure.posture.posture import DOF_COUNT, Posture, pose_joints
from vistel.figure.skeleton import standard_skeleton
from vistel.wrinkle.dressing import ChartedAvatar, dressed
from vistel.wrinkle.drives import Drives
from vistel.wrinkle.region import sides_of
from vistel.wrinkle.shown import CHANNELS, MOST_SETS, PLAIN, ShownWrinkles, shown
from vistel.wrinkle.worn import Worn
from vistel.wrinkle.wrinkle_sets import wrinkle_sets


@pytest.fixture(scope="module")
def made() -> ChartedAvatar:
    return dressed(closed_person(), ("sleeve",))


SETS = wrinkle_sets(["shirt"])


@pytest.fixture(scope="module")
def worn(made: ChartedAvatar) -> Worn:
    return Worn(made.avatar, SETS, made.charts)


@pytest.fixture(scope="module")
def whole(made: ChartedAvatar) -> ShownWrinkles:
    return shown(made, SETS)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-1.5, 1.5), min_size=DOF_COUNT, max_size=DOF_COUNT), st.floats(0.0, 1.0))
def test_weights_are_those_of_each_drive(dofs: list[float], intensity: float) -> None:
    pairs = [(s.entry.drive, side) for s in wrinkle_sets() for side in sides_of(s.region)]
    joints = pose_joints(standard_skeleton(1.75), Posture(np.array(dofs)))
    actions = {"AU1": intensity, "AU12": 1.0 - intensity, "AU6": math.nan}
    one_by_one = [drive.weight(joints, actions, side) for drive, side in pairs]
    assert np.allclose(Drives.of(pairs).weights(joints, actions), one_by_one, atol=1e-7)


def test_sets_over_each_other_are_in_different_channels_on_every_level(whole: ShownWrinkles, made: ChartedAvatar) -> None:
    assert len(whole.names) <= MOST_SETS
    assert len(whole.levels) == 1 + len(made.avatar.coarser)
    for level, avatar in zip(whole.levels, (made.avatar, *made.avatar.coarser), strict=True):
        assert level.sets.shape == (len(avatar.mesh.uv), CHANNELS)
        assert level.count == len(avatar.mesh.vertices)
        # Each set has one channel.
        for s in range(1, len(whole.names) + 1):
            assert len(set(np.nonzero(level.sets == s)[1])) <= 1


def test_the_light_of_all_channels_is_that_of_the_sets(whole: ShownWrinkles, worn: Worn, made: ChartedAvatar) -> None:
    picture = whole.picture().astype(np.float64)
    assert picture.shape == (*made.avatar.albedo.shape[:2], CHANNELS)
    of_all = np.prod(1.0 + (picture - PLAIN) / 127.5, axis=2)
    covered = worn.covered()
    assert np.abs(of_all - worn.light(np.ones(len(worn.sets))))[covered].max() < 0.06


def test_displacement_and_pull_are_those_of_the_figure(whole: ShownWrinkles, worn: Worn, made: ChartedAvatar) -> None:
    weights = np.linspace(0.1, 1.0, len(worn.sets))
    level = whole.levels[0]
    given_ = level.displacement(weights)
    assert given_ is not None
    assert np.allclose(given_, worn.displacement(weights), atol=1e-7)
    known = np.concatenate(([0.0], weights))
    moved = (known[level.sets] * level.pull).sum(axis=1)
    assert np.allclose(moved, (worn.coordinates(weights) - made.avatar.mesh.uv)[:, 1], atol=2e-6)
    assert level.displacement(np.zeros(len(weights))) is None

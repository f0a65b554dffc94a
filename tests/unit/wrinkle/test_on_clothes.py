"""Cloth creases where there is cloth: bare arms do not, and of two layers the upper one."""

from __future__ import annotations

import numpy as np
import pytest
from avatar_fixture import closed_person

from vistel.figure import builtin
from vistel.figure.avatar.avatar import Avatar, clothes
from vistel.wrinkle.region import builtin_regions, tube


def forearm(avatar: Avatar) -> np.ndarray:
    return (np.array(avatar.body.names) == "left_forearm")[avatar.mesh.limb]


@pytest.mark.parametrize(("who", "layers"), [("jonas", 0), ("ben", 1)], ids=["in a T-shirt", "in a blazer over a shirt"])
def test_the_region_of_a_sleeve_is_one_layer_of_cloth(who: str, layers: int) -> None:
    avatar = builtin(who).avatar
    on, member = clothes(avatar), tube(avatar, builtin_regions()["sleeve"], "left_").member
    assert member.any()
    assert len(set(on[member])) == 1
    assert len(set(on[member & forearm(avatar)])) == layers
    assert (on[forearm(avatar)] == -1).any()


def test_where_a_file_does_not_tell_clothes_from_skin_all_of_the_arm_is_sleeve() -> None:
    avatar = closed_person()
    assert (clothes(avatar) == 0).all()
    member = tube(avatar, builtin_regions()["sleeve"], "left_").member
    assert member[forearm(avatar)].mean() > 0.95

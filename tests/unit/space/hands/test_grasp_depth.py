"""The measure of how deep a hand is in a thing, which the benchmark of grasps uses."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.figures.grasp_depth import deepest
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.things.things import Thing, ThingPrimitive

TUBE, ALPHA, TIP = 0.007, 4.0, 0.008
INNER = TUBE * (ALPHA - 1.0)
"""Radius of the hole of a ring [m]."""


@pytest.mark.parametrize("deep", [0.0002, 0.002, 0.005])
def test_a_finger_in_the_inner_side_of_a_ring_is_as_deep_as_it_is_though_the_way_out_leads_through_the_hole(deep: float) -> None:
    ring = ThingPrimitive("supertoroid", (TUBE, TUBE, TUBE, ALPHA, 1.0, 1.0))
    thing = Thing("it", "it", "it", (ring,), 0.1, 0.0, 0, np.zeros(3))
    at = INNER - TIP + deep
    finger = PrimitiveSet.of_kinds(
        ("cone_sphere",), ((at, 0.0, -0.0001, at, 0.0, 0.0001, TIP, TIP),), np.eye(3)[None], np.zeros((1, 3))
    )
    found, touching = deepest(finger, np.array([1]), thing, np.zeros(3), np.eye(3))
    assert found == pytest.approx(deep, abs=1e-4)
    assert touching == 1

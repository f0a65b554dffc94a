"""Meshes that follow their shape: an update gives what a fresh start gives, and touches only what changed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from implicit_shapes import PRIMITIVES

import vistel.implicit as vi
from vistel.implicit.polygonise import Lattice, Polygonisation
from vistel.implicit.polygonise.incremental import changed

LATTICE = Lattice(np.array([0.013, 0.007, 0.011]), 0.05)


def blobs(seed: int, count: int = 12) -> list[vi.Shape]:
    rng = np.random.default_rng(seed)
    names = sorted(set(PRIMITIVES) - {"polyblob in an L"})
    return [
        PRIMITIVES[names[int(rng.integers(len(names)))]].scaled(0.4).moved(rng.uniform(-1.5, 1.5, 3), rng.normal(size=4))
        for _ in range(count)
    ]


def by_edge(made: Polygonisation) -> tuple[dict[int, Any], set[tuple[int, ...]]]:
    """Crossings by lattice edge, and triangles as lattice edges, the least first."""
    edge = made.marched.edge
    triangles = edge[made.marched.triangles]
    first = triangles.argmin(axis=1)
    rows = np.arange(len(triangles))[:, None]
    turned = triangles[rows, (first[:, None] + np.arange(3)) % 3]
    return dict(zip(edge.tolist(), made.marched.points, strict=True)), set(map(tuple, turned.tolist()))


def assert_same(a: Polygonisation, b: Polygonisation) -> None:
    points_a, triangles_a = by_edge(a)
    points_b, triangles_b = by_edge(b)
    assert triangles_a == triangles_b
    assert points_a.keys() == points_b.keys()
    np.testing.assert_allclose([points_a[e] for e in points_a], [points_b[e] for e in points_a], atol=1e-4 * 0.05 * 20)
    assert a.mesh.watertight
    assert a.mesh.manifold


@pytest.mark.parametrize("seed", range(12))
def test_moving_one_primitive_gives_what_a_fresh_start_gives(seed: int) -> None:
    shapes = blobs(seed)
    combine = vi.total if seed % 2 else vi.union
    before = Polygonisation.of(combine(*shapes), lattice=LATTICE)
    rng = np.random.default_rng(seed)
    shapes[3] = shapes[3].moved(rng.uniform(-0.3, 0.3, 3))
    after = before.update(combine(*shapes))
    assert after.redone is not None
    assert_same(after, Polygonisation.of(combine(*shapes), lattice=LATTICE))


def test_what_is_out_of_reach_of_the_change_is_not_touched() -> None:
    still = [vi.Sphere((x, 0, 0), 0.6) for x in (-4.0, -3.4, -2.8)]
    before = Polygonisation.of(vi.total(*still, vi.Sphere((2, 0, 0), 0.5)), lattice=LATTICE)
    after = before.update(vi.total(*still, vi.Sphere((2.2, 0.1, 0), 0.5)))
    old, _ = by_edge(before)
    new, _ = by_edge(after)
    left = [e for e, p in old.items() if p[0] < 0]
    assert left
    assert all(np.array_equal(old[e], new[e]) for e in left)
    assert after.redone is not None
    assert (after.redone[:, 0, 0] * LATTICE.cell > 1.0).all()
    assert after.marched.blocks < 0.5 * before.marched.blocks


def test_primitives_may_come_and_go_and_leave_the_first_bounds() -> None:
    a, b, c = (vi.Sphere((x, 0, 0), 0.6) for x in (0.0, 0.5, 3.0))
    made = Polygonisation.of(vi.total(a, b), lattice=LATTICE)
    for shapes in ((a, b, c), (a, c), (a, b)):
        made = made.update(vi.total(*shapes))
        assert_same(made, Polygonisation.of(vi.total(*shapes), lattice=LATTICE))


def test_many_updates_in_a_row_do_not_drift() -> None:
    shapes = blobs(5, 8)
    made = Polygonisation.of(vi.total(*shapes), lattice=LATTICE)
    rng = np.random.default_rng(1)
    for step in range(8):
        shapes[step] = shapes[step].moved(rng.uniform(-0.2, 0.2, 3))
        made = made.update(vi.total(*shapes))
    assert_same(made, Polygonisation.of(vi.total(*shapes), lattice=LATTICE))


def test_the_same_shape_keeps_its_mesh_and_another_graph_starts_afresh() -> None:
    shapes = blobs(2, 4)
    made = Polygonisation.of(vi.total(*shapes), lattice=LATTICE)
    assert made.update(vi.total(*shapes)).mesh is made.mesh
    other = made.update(vi.union(*shapes))
    assert other.redone is None
    assert_same(other, Polygonisation.of(vi.union(*shapes), lattice=LATTICE))


def test_changes_of_colour_are_changes() -> None:
    def coloured(*colours: tuple[float, float, float]) -> vi.Shape:
        return vi.total(*(vi.Sphere((k, 0, 0), 1.2).with_attributes(colour=c) for k, c in enumerate(colours)))

    made = Polygonisation.of(coloured((1, 0, 0), (1, 0, 0)), lattice=LATTICE)
    after = made.update(coloured((1, 0, 0), (0, 0, 1)))
    fresh = Polygonisation.of(coloured((1, 0, 0), (0, 0, 1)), lattice=LATTICE)
    ours = dict(zip(after.marched.edge.tolist(), after.mesh.attributes["colour"], strict=True))
    for edge, colour in zip(fresh.marched.edge.tolist(), fresh.mesh.attributes["colour"], strict=True):
        np.testing.assert_allclose(ours[edge], colour, atol=1e-5)


def test_only_the_primitives_that_differ_are_found() -> None:
    shapes = [vi.Sphere((k, 0, 0), 0.5) for k in range(5)]
    old = vi.compile(vi.total(*shapes))
    shapes[2] = vi.Sphere((2.0, 0.5, 0), 0.5)
    boxes = changed(old, vi.compile(vi.total(*shapes)))
    assert boxes is not None
    assert len(boxes) == 2
    np.testing.assert_allclose(boxes.mean(axis=1), [(2, 0, 0), (2, 0.5, 0)], atol=1e-6)

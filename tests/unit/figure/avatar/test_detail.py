"""Levels of detail keep the surface closed, near to the finest one, and its texture where it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from figure_fixture import tube_person

from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.detail import coarser, seams, with_levels


def sphere(seam: bool) -> Mesh:
    """A unit sphere of 2,562 vertices; with `seam`, a meridian's drawn vertices are doubled."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    v, t = np.asarray(ball.vertices), np.asarray(ball.faces, np.int64)
    corner_vertex = np.arange(len(v))
    corner_triangles = t.copy()
    if seam:
        east = v[t].mean(axis=1)[:, 0] > 0.0
        both = np.intersect1d(t[east], t[~east])
        twin = np.arange(len(v))
        twin[both] = len(v) + np.arange(len(both))
        corner_triangles[east] = twin[t[east]]
        corner_vertex = np.concatenate([corner_vertex, both])
    uv = 0.5 + 0.5 * v[corner_vertex][:, 1:]
    return Mesh(
        v.astype(np.float32),
        t.astype(np.int32),
        corner_vertex.astype(np.int32),
        uv.astype(np.float32),
        corner_triangles.astype(np.int32),
        np.zeros(len(v), np.int32),
    )


def solid(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)


@pytest.mark.parametrize("seam", [False, True])
def test_a_coarser_sphere_is_closed_and_nearly_as_large(seam: bool) -> None:
    fine = sphere(seam)
    coarse = coarser(fine, 800)
    assert len(coarse.triangles) == 800
    body = solid(coarse)
    assert body.is_watertight and body.is_winding_consistent and body.euler_number == 2
    assert body.volume == pytest.approx(solid(fine).volume, rel=0.03)


def test_vertices_and_their_texture_are_a_part_of_the_finer_ones() -> None:
    fine = sphere(True)
    coarse = coarser(fine, 600)
    assert {tuple(p) for p in coarse.vertices} <= {tuple(p) for p in fine.vertices}
    np.testing.assert_allclose(coarse.uv, 0.5 + 0.5 * coarse.vertices[coarse.corner_vertex][:, 1:], atol=1e-6)
    np.testing.assert_array_equal(coarse.corner_vertex[coarse.corner_triangles], coarse.triangles)


def test_a_seam_stays_where_it_was() -> None:
    coarse = coarser(sphere(True), 600)
    tri, corner = coarse.triangles.astype(np.int64), coarse.corner_triangles.astype(np.int64)
    at = seams(tri, corner).astype(bool)
    assert at.sum() >= 20
    ends = coarse.vertices[np.concatenate([tri[at], np.roll(tri, -1, axis=1)[at]])]
    assert np.abs(ends[:, 0]).max() < 0.06  # the meridian of the finest level runs along x = 0, to an edge's length


def test_what_allows_no_fewer_triangles_keeps_them() -> None:
    box = trimesh.creation.box()
    mesh = Mesh(
        np.asarray(box.vertices, np.float32),
        np.asarray(box.faces, np.int32),
        np.arange(8, dtype=np.int32),
        np.zeros((8, 2), np.float32),
        np.asarray(box.faces, np.int32),
        np.zeros(8, np.int32),
    )
    assert solid(coarser(mesh, 4)).is_watertight


def test_levels_share_what_is_not_the_mesh() -> None:
    avatar = tube_person()
    count = len(avatar.mesh.triangles)
    levels = with_levels(avatar, (count // 2, count // 4)).coarser
    assert [len(level.mesh.triangles) < count for level in levels] == [True, True]
    assert all(level.body is avatar.body and level.albedo is avatar.albedo for level in levels)
    assert isinstance(replace(avatar, coarser=levels), Avatar)


def test_what_is_important_keeps_its_vertices() -> None:
    fine = sphere(False)
    left = fine.vertices[:, 0] < 0.0
    coarse = coarser(fine, 900, np.where(left, np.inf, 1.0))
    kept = {tuple(p) for p in coarse.vertices}
    assert all(tuple(p) in kept for p in fine.vertices[left])
    assert solid(coarse).is_watertight

"""Every golden value of the groups blend, primitive, pointblob, pointset, local, polyblob, combine and appB."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from implicit_golden import group

import vistel.implicit as vi
from vistel.implicit.graph.combine import diff
from vistel.implicit.primitives.shape_change import core_scale, uniform_threshold

BLENDS = {"hermite": vi.HERMITE, "wyvill": vi.WYVILL, "quartic": vi.QUARTIC, "quad2": vi.QUAD2}
GROUPS = ("blend", "primitive", "pointblob", "pointset", "local", "polyblob", "combine", "appB")


def blend(name: str, i: dict[str, Any]) -> Any:
    if name.startswith("max"):
        x = np.linspace(0, 1, 200001)
        return np.abs(vi.WYVILL(x) - vi.QUARTIC(x)).max()
    f = BLENDS[i["f"]]
    if ".inv" in name:
        return f.inverse(i["T"])
    return f.derivative(i["x"]) if ".df" in name else f(i["x"])


def at(shape: vi.Primitive, point: Any) -> tuple[float, np.ndarray]:
    """Distance ratio and its gradient at one point."""
    d, slope = shape.ratio(np.array([point], float))
    return float(d[0]), slope[0]


def primitive(name: str, i: dict[str, Any]) -> Any:
    if name.startswith("sphere"):
        shape: vi.Primitive = vi.Sphere(i["C"], i["r"])
    elif name.startswith("capsule"):
        shape = vi.Sphylinder(i["C1"], i["C2"], i["r"])
    elif name.startswith("rounded_polygon"):
        shape = vi.RoundedPolygon(i["verts"], i["r"])
    elif name.startswith("superellipsoid"):
        shape = vi.Superellipsoid((0, 0, 0), i["a"], i["e1"], i["e2"])
    elif name.startswith("supertoroid"):
        shape = vi.Supertoroid((0, 0, 0), (i["a1"], i["a1"], i["a3"]), i["alpha"], i["e1"], 1.0)
    else:
        return cone_sphere(name, i)
    if "gradF" in name:
        return shape.gradient(i["P"])
    if ".F" in name:
        return shape.field(i["P"])
    return at(shape, i["P"])[1 if "grad_d" in name else 0]


def cone_sphere(name: str, i: dict[str, Any]) -> Any:
    printed = ".printed" in name
    cone = vi.ConeSphere(i["C1"], i["C2"], i["r1"], i["r2"], printed=printed)
    if name.endswith("theta"):
        return cone.theta
    if name.endswith("C0"):
        return cone.apex
    if "crease" in name:
        return crease(cone, i["T"])
    point = np.array(i["P"])
    if name.endswith(".t"):
        q = cone.skeleton_point(point)
        return float((q - cone.apex) @ cone.axis)
    if name.endswith(".N"):
        q = cone.skeleton_point(point)
        return (point - q) / np.linalg.norm(point - q)
    if name.endswith(".s"):
        return float((cone.skeleton_point(point) - np.array(i["C1"])) @ cone.axis)
    return at(cone, point)[1 if "grad_d" in name else 0]


def crease(cone: vi.ConeSphere, threshold: float) -> float:
    """Angle [deg] between the surface's normals just on either side of where cone and small cap meet."""
    level = float(vi.QUARTIC.inverse(threshold))
    along = -cone.axis * math.cos(cone.theta)
    across = np.array([1.0, 0.0, 0.0]) * math.sin(cone.theta)
    point = np.array(cone.start) + (along + across) * cone.radius_start * level
    low, high = (cone.normal(point + step * cone.axis) for step in (-1e-13, 1e-13))
    return math.degrees(math.acos(float(np.clip(low @ high, -1, 1))))


def pointblob(name: str, i: dict[str, Any]) -> Any:
    if name.startswith("sphereV"):
        blob = vi.Pointblob(vi.Sphere((0, 0, 0), 1.5), i["S"])
        return at(blob, i["P"])[1 if "grad" in name else 0]
    blob = vi.Pointblob.of_surface(vi.box((2, 0.8, 0.6)), i["S1"])
    if "dW" in name:
        return at(blob, i["P"])[0] / blob.reach
    return blob.gradient(i["P"]) if "grad" in name else blob.field(i["P"])


def pointset(name: str, i: dict[str, Any]) -> Any:
    printed = "thesis" in name
    if name.startswith("three"):
        blob = vi.PointSetblob(vi.Sphere((0, 0, 0), 1.5), i["S"], smoothing=i["d_smooth"], printed=printed)
    else:
        blob = vi.PointSetblob(vi.box((2, 0.8, 0.6)), [i["S1"], i["S2"]], smoothing=i["d_smooth"], printed=printed)
    points = np.array([i["P"]], float)
    w = blob.weights(points)[0][0]
    if "centres F" not in name and "weights" in name and not name.startswith(("F", "gradF")):
        return w
    if "averaged_only" in name:
        slopes = np.array([b.gradient(i["P"]) for b in blob.blobs])
        return w @ slopes / w.sum()
    return blob.gradient(i["P"]) if name.startswith("gradF") else blob.field(i["P"])


def local(name: str, i: dict[str, Any]) -> Any:
    tri, s = np.array(i["tri"]), np.array(i["S"])
    apex = s - (tri.mean(axis=0) - s)  # closes the triangle to a tetrahedron about S
    tetrahedron = vi.Polyhedron(np.vstack([tri, apex]), ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)))
    blends = [BLENDS[f] for f in i["f"]] + [vi.QUARTIC]
    blob = vi.Pointblob.of_surface(tetrahedron, s, vertex_blends=blends)
    g = blob.fan.find(np.array([i["P"]]))[1][0]
    if name.endswith("dW"):
        return g.sum()
    if name.endswith("barycentric"):
        return g / g.sum()
    return blob.gradient(i["P"]) if "grad" in name else blob.field(i["P"])


def polyblob(name: str, i: dict[str, Any]) -> Any:
    if name.startswith("edge"):
        return at(vi.Polyblob(vi.box(2), vi.box(0.5)), i["P"])[0]
    low = -3.0  # (x + y + z) / sqrt 3 <= 2 closed by three coordinate planes
    corners = np.full((4, 3), low) + np.vstack([np.zeros(3), np.eye(3) * (2 * math.sqrt(3) - 3 * low)])
    hull = vi.Polyhedron(corners, ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)))
    return at(vi.Polyblob(hull, vi.box(0.5)), i["P"])[1 if "grad" in name else 0]


def level(value: float) -> vi.Primitive:
    """A primitive whose field is `value` all along the z axis near the origin."""
    return vi.Sphylinder((0, 0, -9), (0, 0, 9), 1.0, weight=value)


def combine(name: str, i: dict[str, Any]) -> Any:
    origin = np.zeros(3)
    if name.startswith("ricci"):
        shapes = [level(v) for v in i["v"]]
        make = vi.union if "union" in name else vi.intersection
        return make(*shapes, power=i["p"]).field(origin)
    if name.startswith("dDIFF"):
        return diff(i["a"], i["b"], i["n"])[1:]
    shape = vi.Diff((level(i["a"]), level(i["b"])), i["n"], i.get("eps", 0.0))
    return shape.field(origin)


def appB(name: str, i: dict[str, Any]) -> Any:
    if name.startswith("scale"):
        return core_scale(i["sc"], i["threshold"])
    return uniform_threshold(i["s"])


SOLVE: dict[str, Callable[[str, dict[str, Any]], Any]] = {
    "blend": blend,
    "primitive": primitive,
    "pointblob": pointblob,
    "pointset": pointset,
    "local": local,
    "polyblob": polyblob,
    "combine": combine,
    "appB": appB,
}
ENTRIES = [entry for name in GROUPS for entry in group(name)]


def test_golden_file_has_every_group() -> None:
    assert {entry["group"] for entry in ENTRIES} == set(GROUPS)
    assert len(ENTRIES) == 93


@pytest.mark.parametrize("entry", ENTRIES, ids=[f"{e['group']}:{e['name']}" for e in ENTRIES])
def test_golden(entry: dict[str, Any]) -> None:
    found = SOLVE[entry["group"]](entry["name"], entry["inputs"])
    np.testing.assert_allclose(found, entry["expected"], rtol=0, atol=entry["tolerance"])

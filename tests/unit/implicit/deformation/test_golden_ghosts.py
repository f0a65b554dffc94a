"""Every golden value of the groups collision, constraint, ghost and polymesh."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from implicit_golden import group

import vistel.implicit as vi
from vistel.implicit.ghosts.composition import Collision, deformed
from vistel.implicit.ghosts.constraint import Constraint
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.force_field import Directional, Force, compression, expansion
from vistel.implicit.graph.ghost_terms import (
    constraint_field,
    constraint_ratio,
    decay_quartic,
    hold_level,
    lag,
    plateau_weight,
    propagation,
    propagation_cubic,
    propagation_piecewise,
    propagation_quartic,
    unified,
)
from vistel.implicit.meshes.embedding import bound_radius, shape_weight

T = vi.THRESHOLD
QUARTIC_T = float(vi.QUARTIC.inverse(T))


def root(f: Callable[[float], float], low: float, high: float) -> float:
    """Where f changes its sign."""
    rising = f(high) > f(low)
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (low, middle) if (f(middle) > 0) == rising else (middle, high)
    return (low + high) / 2


def on_ray(shape: vi.Shape, direction: Any, low: float = 0.0, high: float = 1.0) -> float:
    """Distance from the origin at which the surface is crossed."""
    d = np.array(direction, float)
    return root(lambda s: float(shape.field(s * d[None])[0]) - T, low, high)


def pair(distance: float, compliance: tuple[float, float] = (1.0, 1.0)) -> list[Deformable]:
    ball = vi.Sphere((0, 0, 0), 1.0)
    return [Deformable("a", ball, compliance[0]), Deformable("b", ball, compliance[1], position=(distance, 0, 0))]


def compliances(w: float) -> tuple[float, float]:
    """Of two bodies, the first of which has Singh's relative rigidity w; the softer one's is 1 (mathematics M3.8)."""
    return (1.0, 2.0 * w) if w <= 0.5 else (2.0 * (1.0 - w), 1.0)


def normals_cosine(radius: float, other: float, apart: float) -> float:
    """N_i . N_j where the surfaces of two balls cross whose centres are `apart` (Figure 71, corrected: mathematics M3.9)."""
    x = (apart * apart + radius * radius - other * other) / (2 * apart)
    point = [(x, math.sqrt(radius * radius - x * x), 0.0)]
    balls = vi.Sphere.of_surface((0, 0, 0), radius), vi.Sphere.of_surface((apart, 0, 0), other)
    one, two = (ball.normal(point)[0] for ball in balls)
    return float(one @ two)


def collision(name: str, i: dict[str, Any]) -> Any:
    if name.startswith("t("):
        return vi.QUARTIC.inverse(i["T"])
    if name.startswith("k="):
        return -vi.QUARTIC.derivative(vi.QUARTIC.inverse(i["T"]))
    if name.startswith("prop_cubic(") or name.startswith("prop_quartic"):
        return propagation_quartic(i["x"], 1 - QUARTIC_T, i.get("c", 0.0))
    if name.startswith("prop_cubic max"):
        x = np.linspace(QUARTIC_T, 1, 30_001)  # holds the maximum at a third
        return propagation_cubic(x, 1 - QUARTIC_T).max()
    if name.startswith("gascuel"):
        return propagation_piecewise(i["s"], i["k"], i["w"], i["a0"])
    if name.startswith("p_field("):
        return propagation(i["y"], i["ye"])
    if name.startswith("p_field max"):
        return propagation(np.linspace(0, i["ye"], 3001), i["ye"]).max()
    if name.startswith("cos_"):
        return normals_cosine(i["Ri"], i["Rj"], i["Ri"] + i["Rj"] - i["th"])
    if name.startswith("rigidity"):
        a, b = pair(i["D"], compliances(i["w"]))
        return on_ray(deformed([a, b], [Collision("b", "a")])["a"], (1, 0, 0), 0, i["D"])
    if name.startswith("three_body"):
        bodies = [Deformable(n, vi.Sphere(tuple(c), i["r"])) for n, c in zip("abc", i["centres"], strict=True)]
        ghosts = [Collision(o.name, t.name, i["ye"]) for o in bodies for t in bodies if o is not t]
        shapes = deformed(bodies, ghosts)
        # The ghost itself: one of the points lies outside a body's realm, where it does not act.
        return [shapes[b.name].operands[1].field(i["P"]) for b in bodies]
    a, b = pair(i["D"])
    if "bulged" in name:
        angle = math.radians(float(name.rsplit("_", maxsplit=1)[-1].split("deg", maxsplit=1)[0]))
        shape = deformed([a, b], [Collision("b", "a", i["ye"])])["a"]
        return on_ray(shape, (math.cos(angle), math.sin(angle), 0.0), 0.3, 1.0)
    radius = root(lambda y: float(a.shape.field([(i["D"] / 2, y, 0)])[0]) - T, 0, 1)
    return math.pi * radius**2 if "area" in name else radius


def constraint(name: str, i: dict[str, Any]) -> Any:
    if name.startswith("con_x"):
        return constraint_ratio(i["x"], i["tprime"])
    if name.startswith("con_field"):
        return constraint_field(i["y"], hold_level(i["tprime"]))
    if name.startswith("F_sphyl"):
        return plateau_weight(i["x"], i["plateau"])
    if name.startswith("max satisfied"):
        return 2 * (i["tprime"] - vi.QUARTIC.inverse(i["T"]))
    if name.startswith("unified"):
        return i["kappa"] * unified(i["y"], i["s"], i["ye"], hold_level(i["tprime"]))
    kappa = i.get("kappa", 1.0)
    a, b = pair(i["D"], (kappa, 1.0))
    held = Constraint("a", "b", (QUARTIC_T, 0, 0), (-QUARTIC_T, 0, 0), reach_a=i.get("rd1"), hold=i.get("tprime", 0.9))
    if "lam" in i:
        axis = held.axis(a, b)
        q = (axis.start + i["lam"] * (axis.end - axis.start))[None]
        fields = [float(body.placed.field(q)[0]) for body in (a, b)]
        return fields[0] / fields[1] if "w=" in name else (T - fields[0]) / (T - fields[1])
    if "Q.x" in name:
        return held.held(a, b).point[0]
    shape = deformed([a, b], [held])["a"]
    return root(lambda x: float(shape.field([(x, i["y"], 0)])[0]) - T, 0.3, 1.0)


def ghost(name: str, i: dict[str, Any]) -> Any:
    if name.startswith("lag"):
        x = np.zeros(1)
        for _ in range(i["n"]):
            x = lag(x, np.ones(1), 1 / 60, i["tau"])
        return x[0]
    if name.startswith("decay"):
        return decay_quartic(i["s"], i["tau"])
    ball = Deformable("ball", vi.Sphere((0, 0, 0), 1.0))
    if name.startswith("directional"):
        shape = deformed([ball], [Force("wind", "ball", Directional((0, 1, 0), i["c"]))])["ball"]
        return on_ray(shape, (0, 1 if name.endswith("+") else -1, 0))
    make = compression if name.startswith("compressive") else expansion
    return on_ray(deformed([ball], [Force("gas", "ball", make((0, 0, 0), 1.0, i["c"]))])["ball"], (1, 0, 0))


def polymesh(name: str, i: dict[str, Any]) -> Any:
    if name == "W printed":
        return shape_weight(i["Rin"], i["Rout"])
    if name.startswith("R_bound"):
        return bound_radius(i["Rin"], i["Rout"], i["wmax"], i.get("Wmax", 1e6))
    if name.startswith("w_v"):
        return T / (shape_weight(i["Rin"], i["R_bound"]) * vi.QUARTIC(0.33 / i["R_bound"]))
    if name.startswith("vertex weight"):
        return T / (i["W"] * vi.QUARTIC(i["d"]))
    limb = vi.Sphylinder(i["capsule"]["C1"], i["capsule"]["C2"], i["capsule"]["r"])
    at, n = np.array(i["P0"], float), np.array(i["n"], float)
    weight = T / float(limb.field(at))
    bodies = [Deformable("limb", weight * limb), Deformable("ball", weight * vi.Sphere(i["sphere"]["C"], i["sphere"]["r"]))]
    shape = deformed(bodies, [Collision("ball", "limb", i["ye"])])["limb"]
    return root(lambda s: float(shape.field((at + s * n)[None])[0]) - T, -0.2, 0.1)


SOLVE: dict[str, Callable[[str, dict[str, Any]], Any]] = {
    "collision": collision,
    "constraint": constraint,
    "ghost": ghost,
    "polymesh": polymesh,
}
ENTRIES = [entry for name in SOLVE for entry in group(name)]


def test_the_golden_file_has_these_groups_in_full() -> None:
    assert len(ENTRIES) == 52


@pytest.mark.parametrize("entry", ENTRIES, ids=[f"{e['group']}:{e['name']}" for e in ENTRIES])
def test_golden(entry: dict[str, Any]) -> None:
    found = SOLVE[entry["group"]](entry["name"], entry["inputs"])
    np.testing.assert_allclose(found, entry["expected"], rtol=0, atol=entry["tolerance"])

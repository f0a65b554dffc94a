"""Which of MakeHuman's data the model keeps: rows of points, targets by name, masks of the skin's parts in texture coordinates."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from scripts.body_model.wheel import MPFB, UNITS, BaseMesh, Target, Wheel
from vistel.arrays import F32, F64, I32
from vistel.figure.body_model.look import AGES, ORIGINS
from vistel.figure.making.files.makehuman import CUBES

DM = 0.1
"""A decimetre, MakeHuman's unit [m]."""
DRAWN = ("body", "helper-tongue", "helper-l-eyelashes-1", "helper-l-eyelashes-2", "helper-r-eyelashes-1", "helper-r-eyelashes-2",
         "helper-lower-teeth", "helper-upper-teeth")  # fmt: skip
EYES = ("helper-l-eye", "helper-r-eye")
FACE = ("head", "eyes", "nose", "mouth", "ears", "chin", "cheek", "forehead", "eyebrows", "neck", "asym")
TRUNK_AND_LIMBS = ("arms", "torso", "legs", "hip", "hands", "feet", "stomach", "pelvis", "buttocks", "breast")
BREAST = "female-young-averagemuscle-averageweight-{}-averagefirmness"
_NEEDLESS = ("asymm-", "genital", "female-", "male-")


@dataclass(frozen=True)
class Rows:
    """What becomes of the points of the base mesh: of: (V,) row in the model, -1 none; joints: cubes by VISTEL's names of joints,
    their rows come last; skin, body: numbers of rows of what is drawn, and of the closed skin, which come first."""

    of: I32
    cubes: dict[str, I32]
    skin: int
    body: int

    def compact(self, offsets: F64) -> F64:
        """(P, 3) of the model [m] from (V, 3) of the base mesh [dm]."""
        kept = np.flatnonzero(self.of >= 0)
        middles = [offsets[rows].mean(axis=0) for rows in self.cubes.values()]
        return DM * np.vstack([offsets[kept[np.argsort(self.of[kept])]], middles])


def rows_of(mesh: BaseMesh) -> Rows:
    """Skin, tongue, lashes, teeth, eyes, joints."""
    of = np.full(len(mesh.points), -1, np.int32)
    count = 0
    ends: dict[str, int] = {}
    for group in (*DRAWN, *EYES):
        rows = np.unique(mesh.quads[group])
        rows = rows[of[rows] < 0]
        of[rows] = count + np.arange(len(rows), dtype=np.int32)
        count += len(rows)
        ends[group] = count
    cubes: dict[str, I32] = {}
    for cube, joint in CUBES.items():
        for side, ours in (("", ""), ("l-", "left_"), ("r-", "right_")):
            group = f"joint-{side}{cube}"
            if group in mesh.quads:
                cubes[ours + joint] = np.unique(mesh.quads[group])
    return Rows(of, cubes, ends[DRAWN[-1]], ends["body"])


def dense(target: Target, count: int) -> F64:
    """(count, 3) of a target."""
    out = np.zeros((count, 3))
    np.add.at(out, target[0], target[1])
    return out


def macros(wheel: Wheel) -> dict[str, Target]:
    """The targets that make sex, age, origin, muscle, weight, height and proportions."""
    out: dict[str, Target] = {}
    for folder in ("", "height/", "proportions/"):
        out |= dict(wheel.targets(f"{MPFB}targets/macrodetails/{folder}"))
    assert {n.split("-")[0] for n in out} <= {*ORIGINS, "universal", "male", "female"} and len(AGES) == 4
    return out


def details(wheel: Wheel) -> Iterator[tuple[str, Target]]:
    """Targets of parts of the body; those of left and right limbs, eyes, ears and cheeks become one of both."""
    for folder in (*FACE, *TRUNK_AND_LIMBS):
        found = dict(wheel.targets(f"{MPFB}targets/{folder}/"))
        if folder == "breast":
            for size in ("min", "max"):
                yield f"breast-size-{ {'min': 'small', 'max': 'large'}[size] }", found[BREAST.format(f"{size}cup")]
        for name, target in found.items():
            if name.startswith(_NEEDLESS):
                continue
            if name.startswith("l-"):
                other = found[f"r-{name[2:]}"]
                yield name[2:], (np.concatenate([target[0], other[0]]), np.concatenate([target[1], other[1]]))
            elif not name.startswith("r-"):
                yield name, target


def units(wheel: Wheel) -> Iterator[tuple[str, Target]]:
    """The face's units under ARKit's names."""
    return wheel.targets(UNITS)


def weights(wheel: Wheel, rows: Rows, bones: tuple[str, ...], count: int) -> F32:
    """(V, J) weights of MakeHuman's own rig in what is drawn."""
    table = wheel.rig("weights.default")["weights"]
    out = np.zeros((count, len(bones)), np.float32)
    for j, name in enumerate(bones):
        for vertex, weight in table.get(name, []):
            out[int(vertex), j] = weight
    kept = np.flatnonzero((rows.of >= 0) & (rows.of < rows.skin))
    return out[kept[np.argsort(rows.of[kept])]]

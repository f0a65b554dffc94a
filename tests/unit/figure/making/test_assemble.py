"""Scanned parts put together: closed, smooth, the colour of one passing into that of the other, and clear words otherwise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from vistel.arrays import F64
from vistel.figure.making.assembly.assemble import Assembled, assemble
from vistel.figure.making.assembly.colour import colour_at
from vistel.figure.making.assembly.piece import MeshPiece, cut, loops
from vistel.figure.making.parts import soundness
from vistel.figure.making.source import MakingError

AROUND = 28
RADIUS = 0.045
LEFT, RIGHT = (200, 90, 60), (90, 120, 200)


@dataclass(frozen=True)
class Tube:
    """A limb along x from `start` to `end` [m], round at its closed end; elliptic and tapering."""

    start: float
    end: float
    open_at_end: bool
    turn: float = 0.0
    move: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def write(self, folder: Path, name: str, colour: tuple[int, int, int], bare: bool = False) -> None:
        rows = np.linspace(self.start, self.end, 15)
        angle = 2 * np.pi * np.arange(AROUND) / AROUND
        rings = [
            np.stack([np.full(AROUND, x), r * np.cos(angle), 0.85 * r * np.sin(angle)], axis=1)
            for x, r in ((x, RADIUS * (1.0 - 0.3 * x)) for x in rows)
        ]
        tip = self.start if self.open_at_end else self.end
        points = np.concatenate([*rings, [[tip + (-0.02 if self.open_at_end else 0.02), 0.0, 0.0]]])
        c, s = np.cos(self.turn), np.sin(self.turn)
        points = points @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T + np.array(self.move)
        faces: list[tuple[int, int, int]] = []
        for i in range(len(rows) - 1):
            for j in range(AROUND):
                a, b = i * AROUND + j, i * AROUND + (j + 1) % AROUND
                faces += [(a, b + AROUND, b), (a, a + AROUND, b + AROUND)]
        apex, row = len(points) - 1, 0 if self.open_at_end else (len(rows) - 1) * AROUND
        for j in range(AROUND):
            a, b = row + j, row + (j + 1) % AROUND
            faces.append((a, b, apex) if self.open_at_end else (b, a, apex))
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points.tolist()]
        if not bare:
            Image.new("RGB", (16, 16), colour).save(folder / f"{name}.png")
            (folder / f"{name}.mtl").write_text(f"newmtl m\nmap_Kd {name}.png\n")
            lines = [f"mtllib {name}.mtl", "usemtl m", *lines, "vt 0.5 0.5"]
        corner = "" if bare else "/1"
        lines += ["f " + " ".join(f"{v + 1}{corner}" for v in face) for face in faces]
        (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")


UPPER = Tube(-0.25, -0.006, open_at_end=True)
LOWER = Tube(0.006, 0.25, open_at_end=False)
PARTS = '[[parts]]\npart = "upper"\nfile = "upper.obj"\n[[parts]]\npart = "lower"\nfile = "lower.obj"\n'


def limbs(folder: Path, upper: Tube = UPPER, lower: Tube = LOWER, text: str = PARTS) -> Path:
    upper.write(folder, "upper", LEFT)
    lower.write(folder, "lower", RIGHT)
    path = folder / "parts.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def elbow(tmp_path_factory: pytest.TempPathFactory) -> Assembled:
    """Two limbs with a gap of 12 mm, the second 3 degrees and 2 mm off."""
    folder = tmp_path_factory.mktemp("elbow")
    return assemble(limbs(folder, lower=replace(LOWER, turn=np.radians(3.0), move=(0.0, 0.002, -0.001))))


def faces_of(whole: Assembled) -> F64:
    return whole.source.points[whole.source.triangles]


def test_the_surface_is_closed_and_in_one_piece(elbow: Assembled) -> None:
    sound = soundness(elbow.source.triangles, len(elbow.source.points))
    assert (sound.border, sound.branching, sound.pieces) == (0, 0, 1)
    assert np.linalg.det(faces_of(elbow)).sum() / 6 > 0.9 * np.pi * 0.85 * RADIUS**2 * 0.5
    assert len(elbow.joints) == 1 and elbow.joints[0].gap == pytest.approx(0.012, abs=0.004)


def test_the_limb_is_as_thick_at_the_joint_as_beside_it(elbow: Assembled) -> None:
    p = elbow.source.points
    near = p[np.abs(p[:, 0]) < 0.03]
    radius = np.hypot(near[:, 1], near[:, 2] / 0.85)
    assert radius.min() > 0.9 * RADIUS and radius.max() < 1.1 * RADIUS  # 2 mm aside are 4 %


def test_polygons_away_from_the_joint_are_those_of_the_scans(elbow: Assembled) -> None:
    p = elbow.source.points
    far = p[p[:, 0] < -0.12]
    rows = np.linspace(-0.25, -0.006, 15)
    assert len(far) == AROUND * int((rows < -0.12).sum()) + 1
    assert np.allclose(np.unique(np.round(far[:, 0], 6)), np.sort([*np.round(rows[rows < -0.12], 6), -0.27]))


def test_colour_passes_from_one_limb_to_the_other_without_a_step(elbow: Assembled) -> None:
    s = elbow.source
    piece = MeshPiece(
        s.points, s.triangles.astype(np.int64), s.uv[s.uv_triangles], s.material.astype(np.int64), s.group.astype(np.int64)
    )
    x = np.linspace(-0.06, 0.06, 121)
    line = np.stack([x, np.full(121, 0.9 * RADIUS), np.zeros(121)], axis=1)
    colour = colour_at(piece, line, s.materials)
    assert np.abs(colour[0] - LEFT).max() < 3 and np.abs(colour[-1] - RIGHT).max() < 3
    # 1 mm of 30 in which they change by 140: at most a third more than evenly, twice for the ends' softness.
    assert np.abs(np.diff(colour, axis=0)).max() < 25.0


def test_limbs_that_overlap_are_blended_too(tmp_path: Path) -> None:
    whole = assemble(limbs(tmp_path, replace(UPPER, end=0.01), replace(LOWER, start=-0.01)))
    assert whole.joints[0].gap < 0.0
    sound = soundness(whole.source.triangles, len(whole.source.points))
    assert (sound.border, sound.branching, sound.pieces) == (0, 0, 1)


def test_landmarks_bring_a_part_to_its_place(tmp_path: Path) -> None:
    there = [[0.05, 0.0, 0.0], [0.2, 0.03, 0.0], [0.2, 0.0, 0.03]]
    away = replace(LOWER, turn=0.5, move=(1.0, 2.0, 3.0))
    c, s = np.cos(0.5), np.sin(0.5)
    here = np.array(there) @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T + np.array(away.move)
    pairs = [[h, t] for h, t in zip(here.tolist(), there, strict=True)]
    whole = assemble(limbs(tmp_path, lower=away, text=PARTS + f"landmarks = {pairs}\n"))
    assert np.ptp(whole.source.points[:, 0]) == pytest.approx(0.54, abs=1e-4)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (PARTS.replace("lower.obj", "gone.obj"), "parts[1]: lower: there is no file gone.obj"),
        (PARTS.replace('"lower"', '"upper"'), "parts: upper stands more than once"),
        (PARTS + "size = 3\n", "parts[1].size: unknown key; expected one of part,"),
        (PARTS + '[[joints]]\nbetween = ["upper", "hand"]\n', "joints[0].between: there is no part 'hand'"),
        (PARTS + "move = [0.0, 0.5, 0.0]\n", "joined to nothing; is the part before lower missing"),
        (PARTS + "move = [0.08, 0.0, 0.0]\n", "too far for ends 4.1 cm in radius; is a part between them missing?"),
        (PARTS + "landmarks = [[[0, 0, 0], [0, 0, 0]]]\n", "1 landmarks, expected three or more"),
        (PARTS + "landmarks = [[[0,0,0],[0,0,0]], [[1,0,0],[1,0,0]], [[2,0,0],[2,0,0]]]\n", "lie in one line"),
        ("unit = 0.001\n" + PARTS, "0.00054 m large; set unit"),
        ("parts = 3", "parts: is 3, expected a list"),
        ("parts", "not valid TOML"),
    ],
)
def test_what_cannot_be_is_reported_in_one_line(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(MakingError) as told:
        assemble(limbs(tmp_path, text=text))
    assert reason in str(told.value) and "\n" not in str(told.value).strip()


def test_a_cut_goes_through_every_face_once_and_keeps_the_area() -> None:
    rng = np.random.default_rng(4)
    points = rng.uniform(-1, 1, (12, 3))
    triangles = rng.permuted(np.tile(np.arange(12), (20, 1)), axis=1)[:, :3]
    piece = MeshPiece(points, triangles, rng.uniform(0, 1, (20, 3, 2)), np.zeros(20, np.int64), np.arange(20))
    whole, level = cut(piece, points[:, 0] - 0.1)
    sign = np.sign(level)[whole.triangles]
    assert not ((sign > 0).any(axis=1) & (sign < 0).any(axis=1)).any()

    def area(p: MeshPiece) -> float:
        c = p.points[p.triangles]
        return float(np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1).sum())

    assert area(whole) == pytest.approx(area(piece))


def test_borders_run_round_holes() -> None:
    square = np.array([[0, 1, 2], [0, 2, 3]])
    assert [sorted(b.tolist()) for b in loops(square)] == [[0, 1, 2, 3]]

"""Makes "scans" of somebody's limbs to try `vistel avatar assemble` with: a built-in person cut into ten parts.

    python examples/avatars/scan_parts.py FOLDER

Every part goes into a file of its own with a texture of its own brightness, as scans made one after the other have.
Between the parts a centimetre is missing, and each lies a little off where it belongs. FOLDER/parts.toml names them.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.body_model import person as body_model
from vistel.figure.making.assembly.piece import MeshPiece, cut
from vistel.figure.people.builtin import described
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_rotvec

GAP = 0.010
"""Left out at each cut [m]."""
TURN, SHIFT = np.radians(1.0), 0.002
"""How far parts lie off, at most about each axis [rad] and along it [m]."""
EXPOSURE = 0.06
"""By how much parts are brighter or darker."""


def cuts(avatar: Avatar) -> dict[str, list[tuple[str, np.ndarray, np.ndarray]]]:
    """The planes that bound each part: (other part, point, normal out of the part)."""
    at = {name: avatar.skeleton.rest[j] for name, j in JOINT_INDEX.items()}
    out: dict[str, list[tuple[str, np.ndarray, np.ndarray]]] = {}

    def between(one: str, other: str, point: np.ndarray, normal: tuple[float, float, float]) -> None:
        n = np.array(normal) / np.linalg.norm(normal)
        out.setdefault(one, []).append((other, point - 0.5 * GAP * n, n))
        out.setdefault(other, []).append((one, point + 0.5 * GAP * n, -n))

    between("torso", "head", 0.72 * at["neck"] + 0.28 * at["head"], (0.0, 1.0, 0.12))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        arm, elbow = at[f"{side}_upper_arm"], at[f"{side}_lower_arm"]
        hip, knee = at[f"{side}_upper_leg"], at[f"{side}_lower_leg"]
        between("torso", f"{side}_upper_arm", 0.72 * arm + 0.28 * elbow, (sign, 0.0, 0.0))
        between(f"{side}_upper_arm", f"{side}_forearm", elbow, (sign, 0.0, 0.0))
        between("torso", f"{side}_thigh", 0.5 * hip + 0.5 * knee, (0.0, -1.0, 0.0))
        between(f"{side}_thigh", f"{side}_shank", knee, (0.0, -1.0, 0.0))
    return out


def whole(avatar: Avatar) -> MeshPiece:
    """Skin and eyeballs; `part`: 0 the skin, 1 and 2 the eyeballs."""
    meshes = (avatar.mesh, *avatar.eyeballs)
    first = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    return MeshPiece(
        np.concatenate([m.vertices for m in meshes]).astype(np.float64),
        np.concatenate([m.triangles + n for m, n in zip(meshes, first[:-1], strict=True)]).astype(np.int64),
        np.concatenate([m.uv[m.corner_triangles] for m in meshes]).astype(np.float64),
        np.zeros(sum(len(m.triangles) for m in meshes), np.int64),
        np.repeat(np.arange(len(meshes)), [len(m.triangles) for m in meshes]),
    )


def part(body: MeshPiece, planes: list[tuple[str, np.ndarray, np.ndarray]], name: str) -> MeshPiece:
    """What of the body lies within planes, each of which cuts only the limb at its point."""
    side = 1.0 if name.startswith("left") else -1.0 if name.startswith("right") else 0.0
    for other, point, normal in planes:
        level = (body.points - point) @ normal
        if name == "torso" and abs(normal[0]) > 0.5:
            level = np.where(body.points[:, 1] < point[1] - 0.2, -1.0, level)
        if name == "torso" and normal[1] < -0.5:
            mine = (body.points[:, 0] > 0) == (other.startswith("left"))
            level = np.where(mine, level, -1.0)
        body, level = cut(body, level)
        body = body.of_faces((level[body.triangles] <= 0).all(axis=1))
    if side:
        middle = body.points[body.triangles].mean(axis=1)
        body = body.of_faces(side * middle[:, 0] > 0)
    return body


def write(piece: MeshPiece, folder: Path, name: str, picture: np.ndarray) -> None:
    """OBJ, MTL and PNG of one part."""
    Image.fromarray(picture).save(folder / f"{name}.jpg", quality=90)
    (folder / f"{name}.mtl").write_text(f"newmtl scan\nmap_Kd {name}.jpg\n")
    used, index = np.unique(piece.triangles, return_inverse=True)
    triangles = index.reshape(-1, 3) + 1
    lines = [f"mtllib {name}.mtl", "usemtl scan"]
    lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in piece.points[used].tolist()]
    lines += [f"vt {u:.6f} {v:.6f}" for u, v in piece.uv.reshape(-1, 2).tolist()]
    for group, label in enumerate(("skin", "left_eye", "right_eye")):
        rows = np.flatnonzero(piece.part == group)
        if len(rows):
            lines.append(f"g {label}")
        for f in rows.tolist():
            lines.append("f " + " ".join(f"{triangles[f, k]}/{3 * f + k + 1}" for k in range(3)))
    (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")


def make(avatar: Avatar, planes_of: dict[str, list[tuple[str, np.ndarray, np.ndarray]]], folder: Path) -> None:
    """The parts and the file that names them."""
    folder.mkdir(parents=True, exist_ok=True)
    body, rng = whole(avatar), np.random.default_rng(6)
    small = np.asarray(Image.fromarray(avatar.albedo).resize((1024, 1024), Image.Resampling.LANCZOS), np.float64)
    text = ['name = "eva"\n']
    for name, planes in planes_of.items():
        piece = part(body, planes, name)
        middle = piece.points[np.unique(piece.triangles)].mean(axis=0)
        if name != "torso":
            turn = matrix_from_rotvec(TURN * rng.uniform(-1, 1, 3))
            moved = (piece.points - middle) @ turn.T + middle + SHIFT * rng.uniform(-1, 1, 3)
            piece = MeshPiece(moved, piece.triangles, piece.uv, piece.material, piece.part)
        bright = 1.0 + EXPOSURE * rng.uniform(-1, 1)
        write(piece, folder, name, np.clip(bright * small, 0, 255).astype(np.uint8))
        text.append(f'[[parts]]\npart = "{name}"\nfile = "{name}.obj"\n')
    if "head" in planes_of:  # there is little neck under a chin: a short zone [m]
        text.append('[[joints]]\nbetween = ["torso", "head"]\nzone = 0.012\n')
    (folder / "parts.toml").write_text("\n".join(text))


def main() -> None:
    folder = Path(sys.argv[1])
    print("making a person, some seconds …", flush=True)
    # A scan is one surface, and long hair would be cut with the neck: what is assembled is joined at the skin alone.
    in_paint = replace(described("builtin:person=carla,hair=bun", "eva", 1.70), dressed=False)
    avatar = body_model.make(in_paint, "eva")
    planes_of = cuts(avatar)
    print("cutting them into parts …", flush=True)
    make(avatar, planes_of, folder)
    print(f"{len(planes_of)} parts; assemble them: vistel avatar assemble {folder / 'parts.toml'} -o eva.usda")


if __name__ == "__main__":
    main()

"""How well the primitives of a built-in person fit its skin: python -m docs.pictures.ghosts.embedding_fit [builtin:person=carla]

Prints a table and makes embedding-fit.png: the person coloured by vertex weight, and histograms of the weights.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from docs.pictures.drawing.implicit_render import font
from docs.pictures.drawing.mesh_render import Part, Studio, normals
from vistel.figure.figure_limbs import limbs_of
from vistel.figure.people.builtin import builtin_avatar
from vistel.implicit.meshes.embedding import embed
from vistel.implicit.meshes.embedding_report import EDGES, FitReport, fit_report

FOLDER = Path(__file__).parent
COLD, WHITE, WARM = np.array((0.20, 0.38, 0.72)), np.array((0.96, 0.95, 0.93)), np.array((0.78, 0.22, 0.16))


def ramp(weight: np.ndarray) -> np.ndarray:
    """(N, 3) blue for weights below 1 (inside the primitive), red above, white at 1; full at 1/2 and 2."""
    t = np.clip(np.log2(np.maximum(weight, 1e-6)), -1, 1)[:, None]
    return np.where(t < 0, WHITE + (COLD - WHITE) * -t, WHITE + (WARM - WHITE) * t)


def coloured(vertices: np.ndarray, triangles: np.ndarray, colour: np.ndarray) -> Part:
    """A mesh with a colour for each vertex, kept in a texture of a pixel each."""
    side = int(np.ceil(np.sqrt(len(vertices))))
    texture = np.zeros((side * side, 3), np.uint8)
    texture[: len(vertices)] = np.clip(colour * 255, 0, 255)
    row, column = np.divmod(np.arange(len(vertices)), side)
    uv = np.column_stack([(column + 0.5) / side, 1 - (row + 0.5) / side]).astype(np.float32)
    corner = triangles.ravel()  # every triangle takes the colour of its first corner: texels are not blended
    flat = np.repeat(triangles[:, 0], 3)
    return Part(
        vertices[corner],
        normals(vertices, triangles)[corner],
        uv[flat],
        np.arange(len(corner)).reshape(-1, 3),
        texture.reshape(side, side, 3),
    )


def histogram(report: FitReport, rows: list[tuple[str, list[int]]], size: tuple[int, int]) -> Image.Image:
    """A bar chart of vertex weights for each row: a name and the primitives it stands for."""
    image = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(image)
    high = (size[1] - 60) // len(rows)
    left, wide = 150, size[0] - 190
    middle = np.sqrt(EDGES[:-1] * EDGES[1:])
    inks = [tuple(int(v) for v in 225 * c) for c in ramp(middle)]
    for k, (name, members) in enumerate(rows):
        counts = np.sum([report.fits[i].counts for i in members], axis=0)
        base = 20 + (k + 1) * high
        words = f"{name}\n{counts.sum()} vertices"
        draw.text((left - 12, base - high / 2), words, "#222222", font(14), anchor="rm", align="right")
        top = max(int(counts.max()), 1)
        for b, n in enumerate(counts):
            x0, x1 = left + wide * b / len(counts), left + wide * (b + 1) / len(counts) - 1
            draw.rectangle((x0, base - (high - 14) * n / top, x1, base), inks[b])
        draw.line((left, base, left + wide, base), "#999999")
    for w in (0.25, 0.5, 1, 2, 4):
        x = left + wide * np.log(w / EDGES[0]) / np.log(EDGES[-1] / EDGES[0])
        draw.line((x, 22, x, 20 + len(rows) * high), "#dddddd" if w != 1 else "#888888")
        draw.text((x, 24 + len(rows) * high), f"{w:g}", "#444444", font(13), anchor="ma")
    text = "vertex weight: 1 where the primitive's surface meets the skin"
    draw.text((left + wide / 2, size[1] - 6), text, "#222222", font(13), anchor="mb")
    return image


def main() -> None:
    spec = sys.argv[1] if len(sys.argv) > 1 else "builtin:person=carla"
    avatar = builtin_avatar(spec, name="fit", height=1.75)
    mesh, names = avatar.mesh, list(avatar.body.names)
    report = fit_report(embed(mesh.vertices, mesh.limb, limbs_of(avatar.skeleton, avatar.body)), names)
    print("\n".join(report.lines()))
    part = coloured(mesh.vertices, mesh.triangles, ramp(report.weight))
    studio = Studio()
    views = (
        ((0.9, 1.25, 3.4), (0.0, 0.885, 0.0), 0.52, (430, 620)),
        ((0.28, 1.64, 0.72), (0.0, 1.62, 0.0), 0.46, (300, 310)),
        ((0.95, 1.75, 0.35), (0.80, 1.41, 0.0), 0.42, (300, 310)),
    )
    whole, head, hand = (studio.photograph([part], eye, at, size, angle) for eye, at, angle, size in views)
    parts = {
        "head and neck": ("skull", "face", "neck"),
        "trunk": ("chest", "breast", "waist", "abdomen", "pelvis", "crotch"),
        "arms": ("arm", "collar"),
        "legs and feet": ("thigh", "shank", "foot"),
    }
    rows = [("all", list(range(len(names))))]
    rest = set(range(len(names)))
    for label, words in parts.items():
        members = [i for i in sorted(rest) if any(w in names[i] for w in words)]
        rest -= set(members)
        if members:
            rows.append((label, members))
    if rest:
        rows.append(("hands", sorted(rest)))
    chart = histogram(report, rows, (560, 620))
    out = Image.new("RGB", (whole.width + head.width + chart.width, 620), "white")
    places = ((0, 0), (whole.width, 0), (whole.width, 310), (whole.width + head.width, 0))
    for image, place in zip((whole, head, hand, chart), places, strict=True):
        out.paste(image, place)
    out.save(FOLDER / "embedding-fit.png", optimize=True)
    print("embedding-fit.png")


if __name__ == "__main__":
    main()

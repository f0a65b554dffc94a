"""Draws docs/pictures/wrinkle-*.png: shapes, primitives and maps, textures, sleeves, faces, whole figures that wear wrinkles.

    python -m docs.pictures.wrinkles.wrinkles [--out FOLDER] [shapes texture traced sleeve face figure ...]

They show what the dissertation's figures 45 to 51 show. The figures need an OpenGL context (EGL without a display; software is
fine).
"""

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from docs.pictures.drawing.mesh_render import View
from docs.pictures.drawing.wrinkle_render import Studio
from vistel.arrays import U8
from vistel.figure.figure import Figure
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import ELBOW, KNEE, SHOULDER, Posture, standing
from vistel.figure.posture.standard import standard_postures
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix, rotvec_from_quaternion
from vistel.wrinkle.displacement import Map, displacement_map
from vistel.wrinkle.dressing import dressed
from vistel.wrinkle.instance import Instance
from vistel.wrinkle.photograph import Looking, edges, trace
from vistel.wrinkle.picture import drawing, relief
from vistel.wrinkle.shape import Branch, Point, WrinkleShape
from vistel.wrinkle.shape_file import builtin_shapes
from vistel.wrinkle.texture import Lighting, wrinkled_texture
from vistel.wrinkle.worn import Worn
from vistel.wrinkle.wrinkle_sets import wrinkle_sets


def sheet(rows: list[list[tuple[str, U8 | Image.Image]]]) -> Image.Image:
    """Pictures with their names, row by row."""
    cells = [[Image.fromarray(p) if isinstance(p, np.ndarray) else p for _, p in row] for row in rows]
    line = 18
    wide = max(sum(c.width + 4 for c in row) for row in cells) - 4
    out = Image.new("RGB", (wide, sum(row[0].height + line for row in cells)), "white")
    ink, y = ImageDraw.Draw(out), 0
    for row, pictures in zip(rows, cells, strict=True):
        x = 0
        for (name, _), picture in zip(row, pictures, strict=True):
            ink.text((x + 4, y + 3), name, fill=(40, 44, 50))
            out.paste(picture, (x, y + line))
            x += picture.width + 4
        y += pictures[0].height + line
    return out


def shapes() -> Image.Image:
    """Figure 45: the taxonomy, drawn and on cloth or skin."""
    cells = [
        (name.replace("_", " "), np.hstack((drawing(s, 190), relief(s, 190, wrinkledness=0.2, seed=3))))
        for name, s in builtin_shapes().items()
    ]
    return sheet([cells[k : k + 3] for k in range(0, len(cells), 3)])


def texture() -> Image.Image:
    """Figures 46 to 49a: primitives, a map of wrinkles, and checked cloth that wears them."""
    size, texels = (0.34, 0.34), 340
    points = [Point(at=(-0.7, -0.1)), Point(at=(0.1, 0.1)), Point(at=(0.7, -0.1), thickness=0.8)]

    def primitive(end: str) -> U8:
        shape = WrinkleShape(name="line", branches=[Branch(points=points, start=end, end=end, cap=2.5)])  # type: ignore[arg-type]
        of = displacement_map([Instance(shape, (0.17, 0.17), (0.13, 0.13), 0.045, 0.02)], size, texels)
        level = np.asarray(of.height / of.height.max() * 255, np.uint8)
        return np.repeat(level[..., None], 3, axis=2)

    known = builtin_shapes()
    wrinkles = [
        Instance(known["sleeve_bend"], (0.17, 0.2), (0.11, 0.09), 0.015, 0.009, 0.1, False, 0.3, 3),
        Instance(known["twist"], (0.12, 0.09), (0.075, 0.075), 0.013, 0.006, 0.5, False, 0.3, 4),
        Instance(known["collar"], (0.2, 0.28), (0.08, 0.05), 0.012, 0.006, 0.0, False, 0.3, 5),
    ]
    of = displacement_map(wrinkles, size, 2 * texels)
    grey = np.asarray(np.clip(128 + of.height / np.abs(of.height).max() * 127, 0, 255), np.uint8)
    cloth = _checked(2 * texels)
    worn, _ = wrinkled_texture(cloth, of, Lighting((-0.3, 0.7, 0.65), 0.4, 0.5, 0.005))

    def half(picture: U8) -> Image.Image:
        return Image.fromarray(picture).resize((texels, texels), Image.Resampling.LANCZOS)

    return sheet(
        [
            [
                ("primitive with round ends", primitive("round")),
                ("with tapering ends", primitive("taper")),
                ("map of three wrinkles", half(np.repeat(grey[..., None], 3, axis=2))),
            ],
            [("cloth", half(cloth)), ("wrinkled", half(worn)), ("plain cloth", half(_plain(of)))],
        ]
    )


def _plain(of: Map) -> U8:
    flat = np.full((*of.height.shape, 3), (196, 190, 178), np.uint8)
    return wrinkled_texture(flat, of, Lighting((-0.3, 0.7, 0.65), 0.4, 0.5, 0.005))[0]


def _checked(texels: int) -> U8:
    """A shirt's checks, and the grain of its weave."""
    x = np.arange(texels)
    band = 0.86 + 0.14 * ((x // 34) % 2)
    line = 1.0 - 0.35 * (np.abs((x % 68) - 17) < 2)
    grain = np.random.default_rng(1).normal(1.0, 0.03, (texels, texels))
    light = np.minimum(band[:, None] * band[None] * line[:, None] * line[None] * grain, 1.05)
    return np.clip(light[..., None] * np.array((196, 204, 214)), 0, 255).astype(np.uint8)


def traced() -> Image.Image:
    """Figure 49a: wrinkles of a photograph as shapes. No photographs: wrinkled textures that were rendered, with noise."""
    rows: list[list[tuple[str, U8 | Image.Image]]] = []
    for name, lamp in (("armpit_pull", 100.0), ("shirt_front_sitting", 80.0)):
        light = math.radians(lamp)
        picture = relief(builtin_shapes()[name], 280, wrinkledness=0.3, seed=8).astype(np.float64)
        picture += np.random.default_rng(2).normal(0.0, 2.0, picture.shape[:2])[..., None]
        photograph = np.clip(picture, 0, 255).astype(np.uint8)
        how = Looking(light=light, blur=2.0, shortest=12.0)
        strength = edges(np.asarray(photograph @ np.array((0.2126, 0.7152, 0.0722)), np.float32), how)
        seen = np.asarray(np.clip(strength / np.quantile(strength, 0.998), 0, 1) * 255, np.uint8)
        found = trace(photograph, name, how).shape
        rows.append(
            [
                ("rendered cloth, with noise", photograph),
                ("edges towards the lamp", np.repeat(seen[..., None], 3, axis=2)),
                ("thinned, as weighted curves", drawing(found, 280)),
                ("synthesised from them", relief(found, 280)),
            ]
        )
    return sheet(rows)


class Dressing:
    """A built-in person with everything there is to wear."""

    def __init__(self, spec: str) -> None:
        made = dressed(builtin_avatar(f"builtin:{spec}", name=spec, height=1.75))
        self.figure, self.worn = Figure(made.avatar), Worn(made.avatar, wrinkle_sets(), made.charts)


def arm(elbow: float, hang: float = 60.0, forward: float = 20.0, knee: float = 0.0) -> Posture:
    """Standing, arms a little forward, elbows bent by so many degrees."""
    dofs = standing().dofs.copy()
    dofs[KNEE] = math.radians(knee)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[ELBOW[side]] = math.radians(elbow)
        down = matrix_from_rotvec(np.array((0.0, 0.0, -sign * math.radians(hang))))
        front = matrix_from_rotvec(np.array((-math.radians(forward), 0.0, 0.0)))
        dofs[SHOULDER[side]] = rotvec_from_quaternion(quaternion_from_matrix(np.ascontiguousarray(front @ down)))
    return Posture(dofs)


def sleeve() -> Image.Image:
    """Figure 49b: a sleeve, straight and bent; without wrinkles above, with them below."""
    studio, who = Studio(), Dressing("person=jonas,top=sweater,pattern=plain")
    outside = View((1.12, 1.38, 0.05), (0.38, 1.2, 0.12), 0.42)
    rows = [
        [
            (
                f"{degrees:g} degrees" + ("" if wrinkled else ", no wrinkles"),
                studio.photograph(who.figure, who.worn, arm(degrees), outside, (300, 300), wrinkled=wrinkled, plain=plain),
            )
            for degrees, plain in ((8.0, False), (60.0, False), (105.0, False), (105.0, True))
        ]
        for wrinkled in (False, True)
    ]
    return sheet(rows)  # type: ignore[arg-type]


def face() -> Image.Image:
    """Figures 50 and 51: brows raised, a frown, a smile and squint; from the front and in profile."""
    studio = Studio()
    looks = {
        "at rest": {},
        "brows raised (AU1)": {"AU1": 1.0},
        "frown (AU4)": {"AU4": 1.0},
        "smile, squint (AU6, AU12)": {"left_AU6": 1.0, "right_AU6": 1.0, "AU12": 1.0},
    }
    rows: list[list[tuple[str, Image.Image]]] = []
    for spec in ("person=erik", "person=ben"):
        who = Dressing(spec)
        for view in (View((0.16, 1.655, 0.60), (0.0, 1.625, 0.03), 0.36), View((0.62, 1.645, 0.18), (0.0, 1.63, 0.03), 0.36)):
            rows.append(
                [
                    (name, studio.photograph(who.figure, who.worn, standing(), view, (270, 270), actions=units))
                    for name, units in looks.items()
                ]
            )
    return sheet([rows[0], rows[1], rows[2]])  # type: ignore[list-item]


def figure() -> Image.Image:
    """Figure 57 and after: whole people, without wrinkles above, with them below."""
    studio, postures = Studio(), standard_postures()
    shots = (
        ("person=david", postures["sitting"], View((0.75, 1.35, 1.45), (0.02, 0.86, 0.12), 0.44)),
        ("person=ben", postures["sitting"], View((0.85, 1.0, 1.35), (0.12, 0.62, 0.22), 0.42)),
        ("person=aiko", postures["overhead"], View((0.35, 1.35, 1.3), (0.0, 1.27, 0.0), 0.36)),
        ("person=carla", arm(70.0, 55.0, 35.0), View((1.2, 1.4, 0.55), (0.3, 1.18, 0.15), 0.38)),
    )
    people = {spec: Dressing(spec) for spec, _, _ in shots}
    rows = [
        [
            (
                "without" if not wrinkled else "with wrinkles",
                studio.photograph(people[s].figure, people[s].worn, posture, view, (310, 330), wrinkled=wrinkled),
            )
            for s, posture, view in shots
        ]
        for wrinkled in (False, True)
    ]
    return sheet(rows)  # type: ignore[arg-type]


PICTURES: dict[str, Callable[[], Image.Image]] = {
    "shapes": shapes,
    "texture": texture,
    "traced": traced,
    "sleeve": sleeve,
    "face": face,
    "figure": figure,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=[*PICTURES])
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    arguments = parser.parse_args()
    for name in arguments.names:
        PICTURES[name]().save(arguments.out / f"wrinkle-{name}.png", optimize=True)


if __name__ == "__main__":
    main()

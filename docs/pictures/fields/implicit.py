"""Make the pictures of docs/explanation/implicit.md: python -m docs.pictures.fields.implicit [name ...]"""

import sys
from collections.abc import Callable

import numpy as np
from PIL import Image, ImageDraw

import vistel.implicit as vi
from docs.pictures.drawing.implicit_render import font, label, render, sheet
from vistel.arrays import F64
from vistel.implicit.primitives.shape_change import ThresholdChange, WeightChange

RED, BLUE, GREEN, GOLD = (0.80, 0.36, 0.30), (0.33, 0.50, 0.76), (0.42, 0.66, 0.42), (0.86, 0.68, 0.34)
BLENDS = {"hermite": vi.HERMITE, "wyvill": vi.WYVILL, "quartic": vi.QUARTIC, "quad2": vi.QUAD2}
INK = {"hermite": "#c0392b", "wyvill": "#2c6fbb", "quartic": "#2f8f4e", "quad2": "#b7791f"}


def star(points: int = 5, outer: float = 1.0, inner: float = 0.45) -> list[tuple[float, float]]:
    """The outline of a star."""
    turn = np.pi * np.arange(2 * points) / points + np.pi / 2
    r = np.where(np.arange(2 * points) % 2 == 0, outer, inner)
    return [(float(x), float(y)) for x, y in zip(r * np.cos(turn), r * np.sin(turn), strict=True)]


def figure_1() -> None:
    """Figure 1: implicit primitive shapes, with the blend function they share."""
    s = vi.Sphere.of_surface
    shapes = {
        "sphere": s((0, 0, 0), 0.8),
        "sphylinder": vi.Sphylinder.of_surface((-0.6, 0, 0), (0.6, 0, 0), 0.5),
        "cone-sphere": vi.ConeSphere.of_surface((-0.6, 0, 0), (0.6, 0, 0), 0.65, 0.3),
        "rounded polygon": vi.RoundedPolygon.of_surface([(x, y, 0) for x, y in star(outer=1.05)], 0.16),
        "superquadric ellipsoid": vi.Superellipsoid.of_surface((0, 0, 0), (0.8, 0.8, 0.7), 0.35, 0.35),
        "superquadric toroid": vi.Supertoroid.of_surface((0, 0, 0), (0.34, 0.34, 0.34), 2.2, 0.6, 1.0),
    }
    pictures = [label(render(shape, (330, 270), height=35), name) for name, shape in shapes.items()]
    sheet(pictures, 3, "fields/figure-01-primitives")


def plot(draw: ImageDraw.ImageDraw, box: tuple[int, int, int, int], curve: F64, ink: str) -> None:
    """A curve (n, 2) in [0, 1]^2 as a line in a box of pixels."""
    x0, y0, x1, y1 = box
    draw.line([(x0 + (x1 - x0) * x, y1 - (y1 - y0) * y) for x, y in curve], ink, 3, joint="curve")


def figure_22() -> None:
    """Figure 22: polynomial blend functions, and the joint of two balls that each of them makes."""
    wide, high = 460, 400
    graph = Image.new("RGB", (wide, high), "white")
    draw = ImageDraw.Draw(graph)
    box = (60, 30, wide - 30, high - 60)
    for k in range(5):
        x, y = box[0] + (box[2] - box[0]) * k / 4, box[3] - (box[3] - box[1]) * k / 4
        draw.line([(x, box[1]), (x, box[3])], "#dddddd")
        draw.line([(box[0], y), (box[2], y)], "#dddddd")
        draw.text((x, box[3] + 6), f"{k / 4:g}", "#444444", font(14), anchor="ma")
        draw.text((box[0] - 8, y), f"{k / 4:g}", "#444444", font(14), anchor="rm")
    t = np.linspace(0, 1, 200)
    for i, (name, blend) in enumerate(BLENDS.items()):
        plot(draw, box, np.column_stack([t, blend(t)]), INK[name])
        draw.text((box[2] - 8, box[1] + 8 + 22 * i), name, INK[name], font(17), anchor="ra")
    draw.text(((box[0] + box[2]) / 2, high - 26), "distance ratio d", "#222222", font(15), anchor="ma")
    draw.text((14, 6), "f(d)", "#222222", font(15))
    pictures = [label(graph, "blend functions")]
    for name, blend in BLENDS.items():
        pair = vi.Sphere.of_surface((-0.62, 0, 0), 0.55, blend=blend) + vi.Sphere.of_surface((0.62, 0, 0), 0.55, blend=blend)
        pictures.append(label(render(pair, (wide, high), azimuth=-90, height=10, width=2.9), f"two balls, {name}"))
    warps = Image.new("RGB", (wide, high), "white")
    draw = ImageDraw.Draw(warps)
    draw.rectangle(box, outline="#dddddd")
    for x in (0.3, 0.4, vi.QUARTIC.inverse(0.5), 0.65, 0.8):
        plot(draw, box, np.column_stack([t, vi.QUARTIC.actuated(float(x))(t)]), "#2f8f4e")
    middle = (box[1] + box[3]) / 2
    draw.line([(box[0], middle), (box[2], middle)], "#c0392b")
    draw.text((box[2] - 6, middle - 22), "T", "#c0392b", font(16), anchor="ra")
    pictures.append(label(warps, "quartic, Moebius warps (muscles)"))
    sheet(pictures, 3, "fields/figure-22-blends")


def plane_picture(shape: vi.Shape, half: float, size: int = 400, level: float = 0.5, z: float = 0.0) -> Image.Image:
    """The field in the plane z: grey levels, contours every 0.1, the surface in red."""
    axis = np.linspace(-half, half, size)
    field = vi.compile(shape).lattice(axis, axis, [z]).field[:, :, 0].T[::-1].astype(float)
    shade = 255 - 150 * np.clip(field, 0, 1.2) / 1.2
    rgb = np.repeat(shade[..., None], 3, axis=2)
    steep = np.hypot(*np.gradient(field)) + 1e-9
    for k in range(1, 10):
        rgb[np.abs(field - 0.1 * k) < 0.5 * steep] = (110, 120, 150)
    rgb[np.abs(field - level) < 1.3 * steep] = (200, 40, 30)
    return Image.fromarray(rgb.astype(np.uint8))


def lantern() -> vi.Polyhedron:
    """A star-shaped solid with planar faces: a star drawn to two points."""
    outline = np.array(star(6, 1.0, 0.62))
    n = len(outline)
    vertices = np.vstack([np.column_stack([outline, np.zeros(n)]), [(0, 0, 0.9), (0, 0, -0.9)]])
    faces = [face for i in range(n) for face in ((i, (i + 1) % n, n), ((i + 1) % n, i, n + 1))]
    return vi.Polyhedron(vertices, tuple(faces))


def figure_17() -> None:
    """Figure 17: a pointblob, its isolated shapes at several thresholds, in section and in space."""
    blob = vi.Pointblob.of_surface(lantern(), (0, 0, 0))
    pictures = [label(plane_picture(blob, 2.0, 360), "field in the plane through S, W in red")]
    pictures += [label(render(blob, (360, 360), threshold=t, width=4.0, height=35), f"threshold {t:g}") for t in (0.9, 0.5, 0.1)]
    sheet(pictures, 4, "fields/figure-17-pointblob")


def figure_18() -> None:
    """Figure 18: pointblobs that blend with each other."""
    body = vi.Pointblob.of_surface(vi.sphere_mesh(0.75, 8, 12), (0, 0, 0)).with_attributes(colour=BLUE)
    knob = vi.Pointblob.of_surface(lantern().scaled(0.45), (0, 0, 0)).moved((0, 0, 1.02)).with_attributes(colour=GOLD)
    spout = vi.Pointblob.of_surface(vi.box((0.5, 0.16, 0.2)), (0, 0, 0)).moved((1.0, 0, 0.15), (0, -0.2, 0, 1))
    handle = vi.Supertoroid.of_surface((0, 0, 0), (0.12, 0.12, 0.12), 3.0).moved((-0.85, 0, 0), (1, 0, 0, 1))
    apart = body | knob | spout.with_attributes(colour=RED) | handle.with_attributes(colour=GREEN)
    together = body + knob + spout.with_attributes(colour=RED) + handle.with_attributes(colour=GREEN)
    pictures = [
        label(render(shape, (460, 400), width=3.6, azimuth=-75, height=18, centre=(0.1, 0, 0.15)), text)
        for shape, text in ((apart, "each for itself (a | b | c)"), (together, "blended (a + b + c)"))
    ]
    sheet(pictures, 2, "fields/figure-18-blended-pointblobs")


def figure_19() -> None:
    """Figure 19: a point-setblob: the field with one centre, with two, and with its blend region."""
    outline = [(-1.3, -0.7), (1.3, -0.7), (1.3, 0.1), (0.7, 0.7), (-0.7, 0.7), (-1.3, 0.1)]
    solid = vi.prism(outline, -0.6, 0.6)
    one = vi.Pointblob.of_surface(solid, (-0.7, 0, 0))
    hard = vi.PointSetblob(solid, [(-0.7, 0, 0), (0.7, 0, 0)], (vi.QUARTIC, vi.Blend("quartic", 3.0)), 0.01)
    soft = vi.PointSetblob(solid, [(-0.7, 0, 0), (0.7, 0, 0)], (vi.QUARTIC, vi.Blend("quartic", 3.0)), 1.0)
    pictures = [
        label(plane_picture(s, 2.1, 400), text)
        for s, text in ((one, "one centre"), (hard, "two, no smoothing"), (soft, "two, smoothing 1.0"))
    ]
    sheet(pictures, 3, "fields/figure-19-point-setblob")


def figure_20() -> None:
    """Figure 20: a point-setblob torus that blends differently with four equal balls."""
    ring = vi.torus_mesh(1.0, 0.3, 24, 8)
    turn = np.pi / 2 * np.arange(4)
    centres = [(float(np.cos(a)), float(np.sin(a)), 0.0) for a in turn]
    blends = [vi.Blend("quartic", w) for w in (0.25, 0.7, 1.6, 5.0)]
    blob = vi.PointSetblob(ring, centres, tuple(blends), 0.6, relaxed=True).with_attributes(colour=BLUE)
    balls = [vi.Pointblob(vi.Sphere((1.75 * x, 1.75 * y, 0.0), 0.62), (1.75 * x, 1.75 * y, 0.0)) for x, y, _ in centres]
    shape = vi.total(blob, *(b.with_attributes(colour=GOLD) for b in balls))
    pictures = [
        label(render(shape, (460, 380), width=4.9, azimuth=-70, height=h, smooth=1), text)
        for h, text in ((55, "four blend centres, four blends"), (88, "from above"))
    ]
    sheet(pictures, 2, "fields/figure-20-point-setblob-torus")


def figure_21() -> None:
    """Figure 21: local control: one blend for the vertices on the left of a box, another on the right."""
    solid = vi.box((1.0, 0.45, 0.45))
    left = [v[0] < 0 for v in solid.vertices]
    soft, tight = vi.Blend("quartic", 0.35), vi.Blend("quartic", 4.0)
    balls = [vi.Sphere.of_surface((x, 0, 0.75), 0.3).with_attributes(colour=GOLD) for x in (-0.6, 0.6)]
    pictures: list[Image.Image] = []
    for text, first, second in (("quartic everywhere", vi.QUARTIC, vi.QUARTIC), ("soft left, tight right", soft, tight)):
        blends = [first if is_left else second for is_left in left]
        blob = vi.Pointblob.of_surface(solid, (0, 0, 0), vertex_blends=blends).with_attributes(colour=BLUE)
        pictures.append(label(plane_picture(blob, 1.9, 380), f"field, {text}"))
        pictures.append(
            label(
                render(vi.total(blob, *balls), (380, 380), width=3.0, azimuth=-75, height=15, centre=(0, 0, 0.3)),
                f"with two balls, {text}",
            )
        )
    sheet(pictures, 2, "fields/figure-21-local-control")


def figure_68() -> None:
    """Figure 68: a square turning into three circles by the threshold, in the plane."""
    square = vi.prism([(-1, -1), (1, -1), (1, 1), (-1, 1)], -3, 3)
    turn = 2 * np.pi * np.arange(20) / 20
    circle = np.column_stack([np.cos(turn), np.sin(turn)]) * 0.22
    rods = [vi.prism(circle + place, -2.9, 2.9) for place in ((-0.4, -0.35), (0.4, -0.35), (0.0, 0.4))]
    blob = vi.Polyblob(square, rods[0] + rods[1] + rods[2])
    pictures = [label(plane_picture(blob, 1.2, 300, level=t), f"threshold {t:g}") for t in (0.02, 0.3, 0.6, 0.8, 0.99)]
    sheet(pictures, 5, "fields/figure-68-threshold")


def figure_69() -> None:
    """Figure 69: shape change by weights: a solid cut by CSG turns into a ball, the ball into a pillar."""
    cut = vi.Pointblob.of_surface(vi.box(0.75), (0, 0, 0)) - vi.Sphylinder.of_surface((0, 0, -1), (0, 0, 1), 0.42)
    cut = (cut - vi.Sphylinder.of_surface((-1, 0, 0), (1, 0, 0), 0.42)).with_attributes(colour=RED)
    ball = vi.Pointblob.of_surface(vi.sphere_mesh(0.85, 16, 32), (0, 0, 0)).with_attributes(colour=GOLD)
    pillar = vi.Polyblob(vi.prism(np.array(star(8, 0.95, 0.8)), -1.6, 1.6), vi.prism(np.array(star(8, 0.2, 0.15)), -0.9, 0.9))
    pillar_ = pillar.with_attributes(colour=BLUE)
    films = [WeightChange(cut, ball), WeightChange(ball, pillar_)]
    pictures = [
        label(render(films[int(s >= 1)].at(s % 1 if s < 2 else 1.0), (300, 330), width=2.7, lattice=90), f"{s:g}")
        for s in (0, 0.4, 0.7, 1.0, 1.3, 1.6, 2)
    ]
    sheet(pictures, 7, "fields/figure-69-weights")


def figure_70() -> None:
    """Figure 70: shape change by the threshold: a torus turns into a cube, with eased timing."""
    film = ThresholdChange.between(vi.torus_mesh(0.8, 0.3, 28, 12), vi.box(0.9))
    pictures: list[Image.Image] = []
    for s in (0.0, 0.25, 0.4, 0.55, 0.75, 1.0):
        shape, threshold = film.at(s)
        picture = render(shape.with_attributes(colour=GREEN), (300, 300), threshold=threshold, width=3.0, height=35, lattice=72)
        pictures.append(label(picture, f"progress {s:g}, T = {threshold:.3f}"))
    sheet(pictures, 6, "fields/figure-70-threshold")


def combinations() -> None:
    """The operators on a ball and a box."""
    ball = vi.Sphere.of_surface((0.35, -0.3, 0.35), 0.62).with_attributes(colour=GOLD)
    cube = vi.Pointblob.of_surface(vi.box(0.6), (0, 0, 0)).with_attributes(colour=BLUE)
    shapes = {
        "a + b": cube + ball,
        "a | b": cube | ball,
        "union(a, b, power=4)": vi.union(cube, ball, power=4),
        "a & b": cube & ball,
        "a - b": cube - ball,
        "difference(a, b, power=6)": vi.difference(cube, ball, power=6),
        "subtract(a, b)": vi.subtract(cube, ball),
        "Diff((a, b))": vi.Diff((cube, ball)),
    }
    sheet(
        [label(render(s, (320, 280), width=3.0, centre=(0.1, -0.1, 0.1)), text) for text, s in shapes.items()],
        4,
        "fields/combinations",
    )


PICTURES: dict[str, Callable[[], None]] = {
    "1": figure_1,
    "17": figure_17,
    "18": figure_18,
    "19": figure_19,
    "20": figure_20,
    "21": figure_21,
    "22": figure_22,
    "68": figure_68,
    "69": figure_69,
    "70": figure_70,
    "combinations": combinations,
}

if __name__ == "__main__":
    for name in sys.argv[1:] or PICTURES:
        PICTURES[name]()

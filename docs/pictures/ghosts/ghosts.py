"""Make the pictures of docs/explanation/ghosts.md: python -m docs.pictures.ghosts.ghosts [name ...]

Names: 5, 9, 10, 11, 33, 72. Figures 14, 15 and the films are made by ghost_scenes.py.
"""

import sys
from collections.abc import Callable, Sequence

import numpy as np
from PIL import Image

import vistel.implicit as vi
from docs.pictures.drawing.ghost_render import BLUE, GOLD, GREEN, GREY, RED, SKIN, picture, section
from docs.pictures.drawing.implicit_render import label, sheet
from vistel.arrays import F64
from vistel.implicit.ghosts.composition import collisions, deformed
from vistel.implicit.ghosts.constraint import Constraint
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.force_field import Force, gravity, wind
from vistel.implicit.ghosts.ghost_kind import Ghost

EDGE = 0.5411961


def ball(
    name: str, at: Sequence[float], radius: float = 1.0, colour: Sequence[float] = GOLD, compliance: float = 1.0
) -> Deformable:
    """A ball of a surface radius; `radius` 1 is a surface radius of 0.54."""
    shape = vi.Sphere((0, 0, 0), radius).with_attributes(colour=colour)
    x, y, z = map(float, at)
    return Deformable(name, shape, compliance, (x, y, z))


def figure_5() -> None:
    """Figure 5: two balls, unequal compliances, three balls: contact surfaces shared, skin raised round them."""
    two = [ball("a", (-0.42, 0, 0), colour=GOLD), ball("b", (0.42, 0, 0), colour=BLUE)]
    hard = [ball("a", (-0.42, 0, 0), colour=GOLD, compliance=0.4), ball("b", (0.42, 0, 0), colour=BLUE)]
    rigid = [ball("a", (-0.42, 0, 0), colour=GREY, compliance=0), ball("b", (0.42, 0, 0), colour=BLUE)]
    turn = np.radians((90, 210, 330))
    three = [
        ball(n, (0.47 * np.cos(t), 0.47 * np.sin(t), 0), colour=c) for n, t, c in zip("abc", turn, (GOLD, BLUE, RED), strict=True)
    ]
    rows = [
        ("as they are", two, False),
        ("equally soft", two, True),
        ("gold 2.5 times stiffer", hard, True),
        ("grey one rigid", rigid, True),
        ("three of them", three, True),
    ]
    pictures: list[Image.Image] = []
    for text, bodies, touching in rows:
        shapes = deformed(bodies, collisions(bodies) if touching else [])
        pictures.append(label(section(shapes, 1.08, (300, 290), centre=(0, 0.13)), text))
    for _, bodies, touching in rows:
        shapes = deformed(bodies, collisions(bodies) if touching else [])
        pictures.append(picture(shapes.values(), (300, 250), width=2.16, azimuth=-90, height=38, centre=(0, 0.06, 0)))
    stacked(pictures[:5], pictures[5:], "ghosts/figure-05-collisions")


def stacked(upper: Sequence[Image.Image], lower: Sequence[Image.Image], name: str) -> None:
    """Two rows of pictures as one sheet."""
    pairs = []
    for above, below in zip(upper, lower, strict=True):
        both = Image.new("RGB", (above.width, above.height + below.height), "white")
        both.paste(below, (0, 0))
        both.paste(above, (0, below.height))
        pairs.append(both)
    sheet(pairs, len(pairs), name)


def joined(a: Deformable, b: Deformable, **options: float) -> Constraint:
    """A constraint between the points of two balls that are nearest to each other."""
    toward = np.array(b.position) - np.array(a.position)
    toward /= np.linalg.norm(toward)
    points = [tuple(map(float, s * radius_of(x) * toward)) for s, x in ((1, a), (-1, b))]
    return Constraint(a.name, b.name, points[0], points[1], **{"hold": 0.78, **options})


def radius_of(body: Deformable) -> float:
    """Surface radius of a ball."""
    return EDGE * float(np.ptp(body.shape.bounds, axis=0)[0]) / 2


def figure_9() -> None:
    """Figure 9: one constraint: points, an area, a stiffer partner, reach of the deformation."""
    cases: list[tuple[str, list[Deformable], dict[str, float]]] = []
    for text, compliance, options in (
        ("points", 1.0, {"reach_a": 0.3, "reach_b": 0.3}),
        ("wider reach", 1.0, {"reach_a": 0.55, "reach_b": 0.55}),
        ("areas (plateau 0.5)", 1.0, {"reach_a": 0.4, "reach_b": 0.4, "plateau": 0.5}),
        ("gold five times stiffer", 0.2, {"reach_a": 0.3, "reach_b": 0.3}),
    ):
        left = ball("a", (-0.63, 0, 0), colour=GOLD, compliance=compliance)
        cases.append((text, [left, ball("b", (0.63, 0, 0), colour=BLUE)], options))
    upper: list[Image.Image] = []
    lower: list[Image.Image] = []
    for text, bodies, options in cases:
        shapes = deformed(bodies, [joined(*bodies, **options)])
        upper.append(label(section(shapes, 1.25, (340, 190)), text))
        lower.append(picture(shapes.values(), (340, 200), width=2.5, azimuth=-90, height=25))
    stacked(upper, lower, "ghosts/figure-09-constraints")


def figure_10() -> None:
    """Figure 10: balls held together by points drift apart; the bulges follow and then let go, one after another."""
    start = np.array(
        [(0, 0, 0), (1.15, 0.1, 0), (0.5, 1.05, 0.1), (-0.75, 0.85, -0.1), (-1.1, -0.2, 0.1), (-0.3, -1.1, 0), (0.85, -0.95, -0.1)],
        float,
    )
    pairs = [(0, 1), (0, 2), (0, 3), (0, 4), (0, 5), (0, 6), (1, 2), (2, 3), (3, 4), (4, 5), (5, 6), (6, 1)]
    ink = [RED, GOLD, BLUE, GREEN, GOLD, BLUE, GREEN]
    pictures: list[Image.Image] = []
    for spread in (0.9, 1.0, 1.08, 1.16, 1.28):
        places = spread * start
        places[1] += (spread - 0.9) * np.array((0.6, 0, 0))
        bodies = [ball(f"b{i}", p, 0.95, ink[i]) for i, p in enumerate(places)]
        ghosts = [joined(bodies[i], bodies[j], reach_a=0.26, reach_b=0.26, hold=0.72) for i, j in pairs]
        shapes = deformed(bodies, [*collisions(bodies), *ghosts])
        held = sum(not g.held(bodies[int(g.a[1])], bodies[int(g.b[1])]).out_of_reach for g in ghosts)
        image = picture(shapes.values(), (330, 300), width=4.3, azimuth=-90, height=62)
        pictures.append(label(image, f"{held} of {len(ghosts)} hold"))
    sheet(pictures, 5, "ghosts/figure-10-constraints-moving")


def figure_11() -> None:
    """Figure 11: a graph with loops: four balls each held to its neighbours, one pair by four points."""
    ring = [
        ball(f"r{i}", (1.62 * np.cos(t), 1.62 * np.sin(t), 0.25 * (-1) ** i), 1.0, c)
        for i, (t, c) in enumerate(zip(np.pi / 4 * np.arange(8), [GOLD, BLUE] * 4, strict=True))
    ]
    chain = [joined(ring[i], ring[(i + 1) % 8], reach_a=0.3, reach_b=0.3) for i in range(8)]
    loop = deformed(ring, [*collisions(ring), *chain])
    top, bottom = ball("top", (0, 0, 0.72), 1.15, RED), ball("bottom", (0, 0, -0.72), 1.15, BLUE)
    r = 1.15 * EDGE
    many: list[Constraint] = []
    for t in np.pi / 2 * np.arange(4):
        lean = np.array((0.55 * np.cos(t), 0.55 * np.sin(t), 0.0))
        up = np.array((0.0, 0.0, np.sqrt(1 - 0.55**2)))
        many.append(
            Constraint("bottom", "top", tuple(r * (lean + up)), tuple(r * (lean - up)), reach_a=0.16, reach_b=0.16, hold=0.78)
        )
    several = deformed([top, bottom], many)
    cage = [
        ball(f"c{i}", p, 0.9, c)
        for i, (p, c) in enumerate(
            zip(0.45 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]), (GOLD, BLUE, GREEN, RED), strict=True)
        )
    ]
    edges = [joined(cage[i], cage[j], reach_a=0.25, reach_b=0.25) for i in range(4) for j in range(i)]
    every = deformed(cage, [*collisions(cage), *edges])
    sheet(
        [
            label(picture(loop.values(), (420, 380), width=4.9, azimuth=-75, height=48), "a ring of eight"),
            label(picture(several.values(), (420, 380), width=3.3, azimuth=-68, height=6), "one pair, four constraints"),
            label(picture(every.values(), (420, 380), width=2.9, azimuth=-20, height=24), "every ball with every other"),
        ],
        3,
        "ghosts/figure-11-constraint-graphs",
    )


def eye(name: str, at: Sequence[float], look: Sequence[float]) -> Deformable:
    """An eyeball that looks along `look`."""
    axis = np.array(look, float) / np.linalg.norm(look)

    def iris(points: F64) -> F64:
        cosine = points @ axis / np.maximum(np.linalg.norm(points, axis=1), 1e-9)
        out = np.tile((0.96, 0.94, 0.92), (len(points), 1))
        out[cosine > np.cos(0.48)] = (0.25, 0.48, 0.62)
        out[cosine > np.cos(0.45)] = (0.36, 0.60, 0.72)
        out[cosine > np.cos(0.20)] = (0.05, 0.05, 0.06)
        return out

    x, y, z = map(float, at)
    return Deformable(name, vi.Sphere((0, 0, 0), 1.0).with_attributes(colour=iris), 1.0, (x, y, z))


def figure_33() -> None:
    """Figure 33: eyeballs that collide; a cone pressed to the floor; a hand of blobs that presses a ball."""
    eyes = [eye("left", (-0.43, 0, 0), (0.45, -1, 0.15)), eye("right", (0.43, 0, 0), (-0.45, -1, 0.15))]
    pair = deformed(eyes, collisions(eyes))
    floor = Deformable(
        "floor",
        vi.RoundedPolygon.of_surface([(-1.3, -1.1, 0), (1.3, -1.1, 0), (1.3, 1.1, 0), (-1.3, 1.1, 0)], 0.2).with_attributes(
            colour=GREEN
        ),
        1.0,
    )
    turn = 2 * np.pi * np.arange(72) / 72
    rim = np.column_stack([0.62 * np.cos(turn), 0.62 * np.sin(turn), np.zeros(72)])
    corners = np.vstack([rim, (0, 0, 1.25), (0, 0, 0)])
    cone = vi.Polyhedron(corners, tuple(f for i in range(72) for f in ((i, (i + 1) % 72, 72), ((i + 1) % 72, i, 73))))
    soft = Deformable("cone", vi.Pointblob.of_surface(cone, (0, 0, 0.35)).with_attributes(colour=GOLD), 0.5, (0, 0, 0.03))
    press = deformed([soft, floor], [*collisions([soft, floor])])
    palm = vi.sphere_mesh(1.0, 12, 20).transformed(np.diag((0.42, 0.17, 0.44)) @ np.eye(3, 4))
    hand: vi.Shape = vi.PointSetblob(palm, [(0, 0, -0.2), (-0.2, 0, 0.12), (0.2, 0, 0.12)], smoothing=0.25)
    for x, long in ((-0.33, 0.50), (-0.11, 0.60), (0.11, 0.62), (0.33, 0.52)):
        knuckle, middle = (x, -0.02, 0.34), (x * 1.1, -0.22, 0.34 + 0.9 * long)
        tip = (x * 1.1, -0.22 - 0.8 * long, 0.34 + 1.05 * long)
        hand = hand + vi.ConeSphere.of_surface(knuckle, middle, 0.10, 0.09) | vi.ConeSphere.of_surface(middle, tip, 0.09, 0.07)
    thumb = vi.ConeSphere.of_surface((0.34, -0.05, -0.15), (0.50, -0.42, 0.0), 0.13, 0.10)
    hand = (hand + thumb) | vi.ConeSphere.of_surface((0.50, -0.42, 0.0), (0.36, -0.78, 0.10), 0.10, 0.075)
    palmed = [Deformable("hand", hand.with_attributes(colour=SKIN), 1.0), ball("ball", (0.02, -0.53, 0.42), 0.82, BLUE)]
    grip = deformed(palmed, collisions(palmed))
    sheet(
        [
            label(picture(pair.values(), (420, 340), width=2.3, azimuth=-90, height=12), "eyeballs collide"),
            label(
                picture(press.values(), (420, 340), width=2.9, azimuth=-70, height=16, centre=(0, 0, 0.4)), "a cone on a soft floor"
            ),
            label(
                picture(grip.values(), (420, 340), width=2.3, azimuth=-8, height=12, centre=(0, -0.3, 0.35)), "a hand and a ball"
            ),
        ],
        3,
        "ghosts/figure-33-collisions",
    )


def figure_72() -> None:
    """Figure 72: wind and gravity on a ball in a corner: at rest, pushed, and stopped by wall and floor."""
    soft = ball("ball", (0, 0, 0), 1.0, GOLD)
    places = {"wall": ((0.2, 1.2, 0.9), (EDGE + 0.2, 0.259, 0)), "floor": ((1.2, 0.2, 0.9), (EDGE - 1.2, -EDGE - 0.2, 0))}
    wall, floor = (Deformable(n, vi.Pointblob.of_surface(vi.box(half, at), at), 0.0) for n, (half, at) in places.items())
    room = [*(Deformable(b.name, b.shape.with_attributes(colour=GREY), 0.0) for b in (wall, floor)), soft]
    forces = [Force("weather", "ball", wind((1, 0, 0), 0.4)), Force("earth", "ball", gravity(0.4))]
    stages: dict[str, list[Ghost]] = {"at rest": [], "wind and gravity": forces, "and collision": [*forces, *collisions(room)]}
    pictures: list[Image.Image] = []
    for text, ghosts in stages.items():
        dashed = ("ball",) if text == "at rest" else ()
        pictures.append(label(section(deformed(room, ghosts), 1.15, (360, 360), levels=dashed), text))
    image = picture(deformed(room, stages["and collision"]).values(), (360, 360), width=2.6, azimuth=-118, height=24, up="y")
    pictures.append(label(image, "in space"))
    sheet(pictures, 4, "ghosts/figure-72-force-fields")


PICTURES: dict[str, Callable[[], None]] = {
    "5": figure_5,
    "9": figure_9,
    "10": figure_10,
    "11": figure_11,
    "33": figure_33,
    "72": figure_72,
}

if __name__ == "__main__":
    for name in sys.argv[1:] or PICTURES:
        PICTURES[name]()

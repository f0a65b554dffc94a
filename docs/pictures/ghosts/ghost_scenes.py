"""Make figures 14 and 15 and the scenes of docs/explanation/ghosts.md: python -m docs.pictures.ghosts.ghost_scenes [name ...]

Names: 14, 15, honey, fly-paper. With --film also an MP4 of each into out/ghosts (needs the package `av`).
"""

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image

import vistel.implicit as vi
from docs.pictures.drawing.ghost_render import picture
from docs.pictures.drawing.implicit_render import label, sheet
from docs.pictures.drawing.mesh_render import Part, Studio
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.figure import Figure, FigureState
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import ELBOW, NECK, SHOULDER, WRIST, Posture, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.implicit.ghosts.composition import collisions, deformed
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.mesh_ghosts import dents
from vistel.implicit.ghosts.temporal import ContactMemory, Plastic, Viscoelastic
from vistel.space.dynamics.soft import SoftRoom

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "examples/ghosts"))
import fly_paper
import honey_drop

from vistel.arrays import F64

BALL = (0.82, 0.36, 0.26)
FILMS = Path(__file__).resolve().parents[3] / "out/ghosts"
SPHERE = vi.sphere_mesh(1.0, 64, 96)
TRIANGLES = np.array([(f[0], f[k], f[k + 1]) for f in SPHERE.faces for k in range(1, len(f) - 1)])


@cache
def studio() -> Studio:
    """One OpenGL context for all."""
    return Studio()


@cache
def person() -> Avatar:
    """The built-in person of the pictures."""
    return builtin_avatar("builtin:person=erik", name="arms", height=1.75)


def limbs(figure: Figure, state: FigureState, name: str, keep: Sequence[int]) -> Deformable:
    """Some groups of a posed figure as one body: the fields its skin is embedded in."""
    rows, fit = figure.embedding.limbs, figure.embedding.fit
    parts = [
        vi.ConeSphere(
            tuple(state.posed.a[i]),
            tuple(state.posed.b[i]),
            fit.radius_a[i] * fit.reach[i],
            fit.radius_b[i] * fit.reach[i],
            weight=float(fit.weight[i]),
        )
        for i in range(len(rows.group))
        if int(rows.group[i]) in keep
    ]
    return Deformable(name, vi.union(*parts))


def skinned(shape: vi.Shape, centre: Sequence[float], radius: float) -> F64:
    """Vertices (V, 3) of a ball's mesh on the surface of its deformed field, each on its ray from the centre."""
    middle, away = np.array(centre, float), np.asarray(SPHERE.vertices, float)
    away = away / np.linalg.norm(away, axis=1, keepdims=True)
    program = vi.compile(shape, attributes=False)
    low, high = np.full(len(away), 0.05 * radius), np.full(len(away), 1.84 * radius)
    steps = np.linspace(0.05, 1.84, 60) * radius
    field = program.field(middle + steps[:, None, None] * away)
    first = np.argmax(field < vi.THRESHOLD, axis=0)
    high, low = steps[first], steps[np.maximum(first - 1, 0)]
    for _ in range(24):
        half = 0.5 * (low + high)
        inside = program.field(middle + half[:, None] * away) >= vi.THRESHOLD
        low, high = np.where(inside, half, low), np.where(inside, high, half)
    return middle + (0.5 * (low + high))[:, None] * away


def ball_ghost(centre: Sequence[float], radius: float) -> PrimitiveSet:
    """A ball as a set of primitives."""
    return PrimitiveSet.of_kinds(["sphere"], [[radius]], np.eye(3)[None], np.array([centre], float))


def ball_body(name: str, centre: Sequence[float], radius: float, compliance: float = 1.0) -> Deformable:
    """The same as a body."""
    x, y, z = map(float, centre)
    return Deformable(name, vi.Sphere.of_surface((0, 0, 0), radius), compliance, (x, y, z))


def dressed(figure: Figure, state: FigureState) -> list[Part]:
    """A figure as it is drawn."""
    avatar = figure.avatar
    parts = [Part.worn(avatar, avatar.mesh, state.vertices, state.normals)]
    return parts + [Part.worn(avatar, m, v, n) for m, (v, n) in zip(avatar.eyeballs, state.eyeballs, strict=False)]


def posture(**angles: Sequence[float] | float) -> Posture:
    """A standing posture with some degrees of freedom set by name."""
    rest = Posture()
    dofs = np.array(rest.dofs, float)
    places = {
        "neck": NECK,
        **{f"{s}_{n}": t[s] for s in ("left", "right") for n, t in (("shoulder", SHOULDER), ("elbow", ELBOW), ("wrist", WRIST))},
    }
    for name, value in angles.items():
        dofs[places[name]] = value
    return replace(rest, dofs=dofs)


def nearest_groups(figure: Figure, state: FigureState, centre: Sequence[float], radius: float) -> list[int]:
    """Groups whose fields reach a ball."""
    fields = figure.fields(state.posed, np.array([centre], np.float32))
    near = limbs_near(figure, state, np.array(centre, float), radius)
    return sorted(set(np.flatnonzero(fields[:, 0] > 0)) | near)


def limbs_near(figure: Figure, state: FigureState, centre: F64, radius: float) -> set[int]:
    """Groups with a primitive whose surface is within two radii of a ball's centre."""
    rows, out = figure.embedding.limbs, set[int]()
    for i, group in enumerate(rows.group):
        a, b = state.posed.a[i], state.posed.b[i]
        s = np.clip((centre - a) @ (b - a) / max(float((b - a) @ (b - a)), 1e-12), 0, 1)
        thick = max(figure.embedding.fit.radius_a[i], figure.embedding.fit.radius_b[i])
        if np.linalg.norm(centre - a - s * (b - a)) < 2 * radius + thick:
            out.add(int(group))
    return out


def film(frames: Iterable[Image.Image], name: str, rate: int = 30) -> None:
    """An MP4 in out/ghosts."""
    import av  # films only

    FILMS.mkdir(parents=True, exist_ok=True)
    with av.open(str(FILMS / f"{name}.mp4"), "w") as box:
        stream = None
        for image in frames:
            if stream is None:
                stream = box.add_stream("h264", rate=rate)
                stream.width, stream.height, stream.pix_fmt = image.width // 2 * 2, image.height // 2 * 2, "yuv420p"
            for packet in stream.encode(av.VideoFrame.from_image(image.crop((0, 0, stream.width, stream.height)))):
                box.mux(packet)
        if stream is not None:
            for packet in stream.encode():
                box.mux(packet)
    print(f"out/ghosts/{name}.mp4")


def arm_and_ball(depth: float) -> list[Part]:
    """A ball that lies `depth` metres deep in a bare forearm; both give way."""
    figure = Figure(person())
    bent = posture(left_shoulder=(0.0, 0.0, -0.15), left_elbow=0.5)
    state = figure.pose(bent)
    elbow, hand = (state.joints.position[JOINT_INDEX[n]] for n in ("left_lower_arm", "left_hand"))
    along = (hand - elbow) / np.linalg.norm(hand - elbow)
    up = np.array((0.0, 1.0, 0.0)) - along[1] * along
    up /= np.linalg.norm(up)
    radius = 0.07
    centre = elbow + 0.45 * (hand - elbow) + (0.040 + radius - depth) * up
    state = figure.pose(bent, [ghosts_of(ball_ghost(centre, radius))])
    bodies = [limbs(figure, state, "arm", nearest_groups(figure, state, centre, radius)), ball_body("ball", centre, radius)]
    shape = deformed(bodies, collisions(bodies))["ball"]
    return [*dressed(figure, state), Part.plain(skinned(shape, centre, radius), TRIANGLES, BALL)]


def crossed_arms(apart: float) -> list[Part]:
    """Forearms of one person that lie on each other, and press into each other as `apart` [rad] gets less."""
    figure = Figure(person())
    crossed = posture(left_shoulder=(apart, -1.45, -0.42), left_elbow=1.5, right_shoulder=(0.0, 1.45, 0.62), right_elbow=1.5)
    return dressed(figure, figure.pose(crossed))


def figure_14() -> None:
    """Figure 14: an arm and a ball; two arms of one person."""
    eye, at, size = (0.62, 1.62, 0.80), (0.53, 1.41, 0.02), (360, 330)
    shots = [(arm_and_ball(depth), text) for depth, text in ((-0.03, "a ball"), (0.003, "touches"), (0.028, "and is pressed in"))]
    shots.append((shots[-1][0][:-1], "what the arm looks like there"))
    upper = [label(studio().photograph(parts, eye, at, size, 0.40), text) for parts, text in shots]
    front, above = ((0.22, 1.48, 1.15), (0.0, 1.30, 0.2)), ((0.0, 2.0, 0.9), (0.0, 1.27, 0.25))
    below = [
        label(studio().photograph(crossed_arms(apart), *view, size, 0.34), text)
        for apart, view, text in (
            (0.30, front, "two arms of one person"),
            (0.12, front, "press on each other"),
            (0.05, front, "harder"),
            (0.05, above, "seen from above"),
        )
    ]
    sheet([*upper, *below], 4, "ghosts/figure-14-arm-and-ball")


BALL_RADIUS = 0.048


def head_and_ball(seconds: float, rate: int) -> Iterator[tuple[float, list[Part]]]:
    """A viscoelastic ball bounces off a plastic head: times [s] and what is to be seen, `rate` pictures a second."""
    figure = Figure(person())
    state = figure.pose(standing())
    away = np.array((0.0, 0.50, 0.86)) / np.linalg.norm((0.0, 0.50, 0.86))
    middle = state.joints.position[JOINT_INDEX["head"]] + np.array((0.0, 0.10, 0.02))
    along = (state.vertices - middle) @ away
    beside = np.linalg.norm(state.vertices - middle - along[:, None] * away, axis=1)
    brow = middle + along[beside < 0.01].max() * away
    head = limbs(figure, state, "head", nearest_groups(figure, state, brow, BALL_RADIUS))
    memory = ContactMemory({"head": Plastic(), "ball": Viscoelastic(0.35)})
    speed, deepest, substeps = 0.8, 0.022, 4
    dt = 1.0 / rate / substeps
    for k in range(round(seconds * rate * substeps)):
        time = k * dt
        # Free flight, and in touch half a swing of a spring that the head's and the ball's pressure make.
        swing = np.pi * deepest / (2 * speed)
        start = 0.12
        if time < start:
            gap = speed * (start - time)
        elif time < start + 2 * swing:
            gap = -deepest * np.sin(np.pi * (time - start) / (2 * swing))
        else:
            gap = 0.55 * speed * (time - start - 2 * swing)
        centre = brow + (BALL_RADIUS + gap) * away + np.array((0.0, -0.6 * max(0.0, time - start - 2 * swing) ** 2, 0.0))
        bodies = [head, ball_body("ball", centre, BALL_RADIUS)]
        memory = memory.step(bodies, time, dt)
        if k % substeps:
            continue
        sources = [ghosts_of(ball_ghost(centre, BALL_RADIUS))]
        sources += dents(memory, "ball", head, ball_ghost((0.0, 0.0, 0.0), BALL_RADIUS), time)
        state = figure.pose(standing(), sources)
        ball = deformed(bodies, [*collisions(bodies), *memory.ghosts(time)])["ball"]
        yield time, [*dressed(figure, state), Part.plain(skinned(ball, centre, BALL_RADIUS), TRIANGLES, BALL)]


def head_shot(parts: Sequence[Part], size: tuple[int, int]) -> Image.Image:
    """The camera of figure 15."""
    return studio().photograph(parts, (0.80, 1.74, 0.42), (0.0, 1.685, 0.13), size, 0.36)


def figure_15() -> None:
    """Figure 15: a ball bounces off a head; the head is plastic, the ball viscoelastic."""
    wanted = [0.0, 0.20, 0.2667, 0.3333, 0.5333]
    shots = {}
    for time, parts in head_and_ball(0.56, 15):
        for w in wanted:
            if abs(time - w) < 0.5 / 15:
                shots[w] = label(head_shot(parts, (330, 360)), f"{time:.2f} s")
    sheet(list(shots.values()), 5, "ghosts/figure-15-ball-off-head")


def drops(frames: int) -> Iterator[SoftRoom]:
    """The honey scene, 30 times a second."""
    now = honey_drop.room()
    for _ in range(frames):
        yield now
        now = now.step(1 / 30)


def honey_shot(now: SoftRoom, size: tuple[int, int], smooth: int = 2) -> Image.Image:
    """The camera of the honey scene."""
    return picture(now.shapes().values(), size, up="y", width=0.115, azimuth=-90, height=9, centre=(0, 0, 0.037), smooth=smooth)


def honey() -> None:
    """A drop of honey lets go of a lid."""
    wanted = (0, 5, 9, 12, 15, 19)
    pictures = [label(honey_shot(now, (250, 330)), f"{now.time:.2f} s") for k, now in enumerate(drops(20)) if k in wanted]
    sheet(pictures, 6, "ghosts/honey-drop")


def flies(frames: int) -> Iterator[SoftRoom]:
    """The fly-paper scene, 30 times a second."""
    now = fly_paper.room()
    for _ in range(frames):
        yield now
        now = fly_paper.struggle(now, 1 / 30)


def fly_shot(now: SoftRoom, size: tuple[int, int], smooth: int = 2) -> Image.Image:
    """The camera of the fly-paper scene."""
    return picture(now.shapes().values(), size, up="y", width=0.100, azimuth=-66, height=14, centre=(0, 0, 0.018), smooth=smooth)


def fly() -> None:
    wanted = (0, 9, 13, 16, 23)
    pictures = [label(fly_shot(now, (360, 280)), f"{now.time:.2f} s") for k, now in enumerate(flies(24)) if k in wanted]
    sheet(pictures, 5, "ghosts/fly-paper")


def films() -> None:
    rising = [*np.linspace(-0.03, 0.03, 45), *np.linspace(0.03, -0.03, 45)]
    film(
        (studio().photograph(arm_and_ball(float(d)), (0.62, 1.62, 0.80), (0.53, 1.41, 0.02), (640, 480), 0.40) for d in rising),
        "figure-14-arm-and-ball",
    )
    film((head_shot(parts, (640, 480)) for _, parts in head_and_ball(1.4, 60)), "figure-15-ball-off-head")
    film((honey_shot(now, (360, 420), 1) for now in drops(36)), "honey-drop")
    film((fly_shot(now, (480, 360), 1) for now in flies(36)), "fly-paper")


PICTURES: dict[str, Callable[[], None]] = {"14": figure_14, "15": figure_15, "honey": honey, "fly-paper": fly}

if __name__ == "__main__":
    for name in [a for a in sys.argv[1:] if a != "--film"] or PICTURES:
        PICTURES[name]()
    if "--film" in sys.argv:
        films()

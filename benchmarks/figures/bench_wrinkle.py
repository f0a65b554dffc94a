"""Wrinkles: displacement maps, textures, what they add to three dressed figures; and expressions of another head.

The peer draws each curve with OpenCV and takes its distance transform in the same window, with one thickness and height for
a wrinkle: the least that a map of offset densities takes. Processor time, medians, one thread.
"""

import math
from collections.abc import Iterator

import cv2
import numpy as np

from benchmarks.fields.bench_field import alternating
from benchmarks.figures import face_rules, wrinkle_frames
from benchmarks.row import Row, at_most
from vistel.figure.figure import Figure
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import ELBOW, KNEE, Posture, pose_joints, standing
from vistel.wrinkle.curve import sampled
from vistel.wrinkle.displacement import displacement_map
from vistel.wrinkle.dressing import dressed
from vistel.wrinkle.instance import Instance
from vistel.wrinkle.shape_file import builtin_shapes
from vistel.wrinkle.texture import drawn_in, wrinkled_texture
from vistel.wrinkle.worn import Worn
from vistel.wrinkle.wrinkle_sets import wrinkle_sets

SIZE = (0.7, 0.7)
TEXELS, WRINKLES = 2048, 100
PEOPLE = ("person=carla", "person=jonas", "person=ben")
POSTURES = 24
LIMIT = 0.003


def wrinkles() -> list[Instance]:
    """A hundred wrinkles of cloth all over a piece of 70 cm."""
    random = np.random.default_rng(7)
    shapes = [s for s in builtin_shapes().values() if s.material == "cloth"]
    out: list[Instance] = []
    for k in range(WRINKLES):
        unit = random.uniform(0.05, 0.09)
        at = random.uniform(0.1, 0.6, 2)
        shape = shapes[k % len(shapes)]
        turn = random.uniform(0.0, 2.0 * math.pi)
        out.append(Instance(shape, (at[0], at[1]), (unit, unit), 0.014, 0.006, turn, bool(k % 2), 0.3, k))
    return out


def by_distance_transforms(every: list[Instance]) -> np.ndarray:
    """The same hundred as the peer draws them."""
    step = SIZE[0] / TEXELS
    out = np.zeros((TEXELS, TEXELS), np.float32)
    for one in every:
        lines = [(sampled(p, 16)[0] / step).round().astype(np.int32) for p in one.control_points()]
        radius = one.thickness / step
        low = np.maximum(np.min([line.min(axis=0) for line in lines], axis=0) - math.ceil(radius), 0)
        high = np.minimum(np.max([line.max(axis=0) for line in lines], axis=0) + math.ceil(radius) + 1, TEXELS)
        window = np.full((high[1] - low[1], high[0] - low[0]), 255, np.uint8)
        cv2.polylines(window, [line - low for line in lines], False, 0)
        u = (cv2.distanceTransform(window, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) / radius) ** 2
        out[low[1] : high[1], low[0] : high[0]] += one.intensity * np.where(u < 1.0, (1.0 - u) ** 2, 0.0)
    return out


def postures() -> list[Posture]:
    """Sitting people who bend and stretch their arms and legs."""
    out: list[Posture] = []
    for k in range(POSTURES):
        dofs = standing().dofs.copy()
        share = 0.5 - 0.5 * math.cos(2.0 * math.pi * k / POSTURES)
        dofs[ELBOW["left"]], dofs[ELBOW["right"]] = math.radians(120.0 * share), math.radians(100.0 * (1.0 - share))
        dofs[KNEE] = math.radians(90.0 * share)
        out.append(Posture(dofs))
    return out


def run() -> Iterator[Row]:
    cv2.setNumThreads(1)
    every = wrinkles()
    displacement_map(every[:1], SIZE, 64)
    ours, theirs = alternating(3, lambda: displacement_map(every, SIZE, TEXELS), lambda: by_distance_transforms(every))
    case = f"{TEXELS} x {TEXELS} map, {WRINKLES} wrinkles"
    peer = f"OpenCV {cv2.__version__} distance transforms"
    yield Row("wrinkle", case, "displacement map", "s", ours, peer, theirs, target=at_most(2))
    of = displacement_map(every, SIZE, TEXELS)
    flat = np.full((TEXELS, TEXELS, 3), 128, np.uint8)
    lit, _ = alternating(3, lambda: wrinkled_texture(flat, of, limit=LIMIT), lambda: None)
    yield Row("wrinkle", case, "wrinkled texture", "s", lit)
    _, loss = drawn_in(of, LIMIT)
    yield Row("wrinkle", case, "texture moves, most", "mm", 1e3 * loss.shift, target=at_most(1e3 * LIMIT * (1 + 1e-6)))
    yield Row("wrinkle", case, "to keep lengths it would", "mm", 1e3 * loss.wanted)
    yield from _figures()
    yield from wrinkle_frames.rows(PEOPLE)
    yield from face_rules.rows()


def _figures() -> Iterator[Row]:
    people = [dressed(builtin_avatar(f"builtin:{spec}", name=spec, height=1.75)) for spec in PEOPLE]
    figures = [Figure(p.avatar) for p in people]
    worn = [Worn(p.avatar, wrinkle_sets(), p.charts, textures=False) for p in people]
    every = postures()

    def plain() -> None:
        for posture in every:
            for figure in figures:
                figure.pose(posture)

    def wrinkled() -> None:
        for posture in every:
            for figure, wears in zip(figures, worn, strict=True):
                weights = wears.weights(pose_joints(figure.avatar.skeleton, posture))
                wears.coordinates(weights)
                figure.pose(posture, (), wears.displacement(weights))

    wrinkled()
    ours, theirs = (1e3 * t / POSTURES for t in alternating(7, wrinkled, plain))
    yield Row("wrinkle", "3 dressed figures posed by the processor", "with wrinkles", "ms", ours, "without", theirs)

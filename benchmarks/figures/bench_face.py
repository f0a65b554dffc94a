"""Cameras for face and eye: marks found in 10,000 hard pictures, gaze, and pupils in real infrared pictures.

Pictures of faces are drawn (face_scenes.py): noise of 3 grey levels, expressions at random, marks that pass over each other,
a hand, light that fades and reddens, a slipping helmet. Times are processor time of one thread.

Pupils: 92 open and 5 closed eyes under ../shared/data/eye. Their boxes mark the iris, loosely; where the pupil is was marked by
hand on all 92 (eye_pupils.csv) before any was looked at by the program. The program was made on the pictures of half of
the people (MADE_ON); those of the others are told apart below.
"""

import csv
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from benchmarks.figures.face_scenes import RATE_HZ, hard_face
from benchmarks.row import NONE_AT_ALL, Row, at_least, at_most
from vistel.arrays import F64, U8
from vistel.figure.face.marks import MARK_COUNT, REST
from vistel.vision.eye_reader import EyeReader
from vistel.vision.face_calibration import calibrate_face
from vistel.vision.face_reader import FaceReader
from vistel.vision.gaze_calibration import GAZE_TARGETS, calibrate_gaze
from vistel.vision.pupil import LEAST_CONFIDENCE, find_pupil
from vistel_sim.pictures.eye import HEIGHT, WIDTH, EyePicture

FRAMES = 10_000
SEED = 11
PEER_EVERY = 25
WRONG_PX = 5.0
DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "eye" / "mrgaze"
MADE_ON = ("02txw", "04axa", "08tad", "14jjh", "CC0003", "RA0077", "RA0546", "RA0813")
NEAR = 0.15
"""Of the iris's radius."""
_BLOBS = f"OpenCV {cv2.__version__}: HSV range, SimpleBlobDetector"
_HOUGH = f"OpenCV {cv2.__version__}: HoughCircles"


def run() -> Iterator[Row]:
    cv2.setNumThreads(1)
    yield from _marks()
    yield from _simulated_eye()
    yield from _real_eyes()


@dataclass
class _Tally:
    """errors: [px] of marks that are claimed; guesses: of the others. swapped: claimed at another mark's place."""

    errors: list[F64]
    guesses: list[F64]
    ms: list[float]
    peer_ms: list[float]
    peer_errors: list[F64]
    swapped: int = 0
    wrong: int = 0
    lost: int = 0


def _marks() -> Iterator[Row]:
    t = _track()
    case = f"marks, 640x480, {FRAMES} frames"
    ms, peer = float(np.median(t.ms)), float(np.median(t.peer_ms))
    errors, guesses = np.concatenate(t.errors), np.concatenate(t.guesses)
    rms = _rms(errors)
    yield Row("face", case, "time per frame", "ms", ms, _BLOBS, peer, target=at_most(4))
    yield Row("face", case, "time per frame p95", "ms", float(np.percentile(t.ms, 95)))
    yield Row("face", case, "centroid error RMS", "px", rms, _BLOBS, _rms(np.concatenate(t.peer_errors)), target=at_most(0.3))
    yield Row("face", case, "centroid error p99", "px", float(np.percentile(errors, 99)))
    yield Row("face", case, "identity swaps", "marks", t.swapped, target=NONE_AT_ALL)
    yield Row("face", case, f"claimed > {WRONG_PX:.0f} px off", "marks", t.wrong)
    told = 100.0 * len(guesses) / (FRAMES * MARK_COUNT)
    yield Row("face", case, "told as guessed", "%", told)
    yield Row("face", case, "guesses' error, median", "px", float(np.median(guesses)))
    yield Row("face", case, "frames without a face", "frames", t.lost)


def _track() -> _Tally:
    painter, face = hard_face(SEED, FRAMES)
    reader = FaceReader(calibrate_face([painter.draw(REST, k) for k in range(30)]))
    t = _Tally([], [], [], [], [])
    for k in range(FRAMES):
        if k % 1000 == 0 and sys.stderr.isatty():
            print(f"face: {k} of {FRAMES} frames", file=sys.stderr)
        now = face.at(k / RATE_HZ)
        frame, true = painter.draw(now.marks, k, now.view), painter.centres(now.marks, now.view)
        began = time.thread_time()
        reading = reader.read(frame, 1.0 / RATE_HZ)
        t.ms.append(1e3 * (time.thread_time() - began))
        if k % PEER_EVERY == 0:
            began = time.thread_time()
            blobs = _blobs(frame)
            t.peer_ms.append(1e3 * (time.thread_time() - began))
            miss = _apart(true, blobs).min(1, initial=np.inf)
            t.peer_errors.append(miss[miss < WRONG_PX])
        if reading.marks is None:
            t.lost += 1
            continue
        apart = _apart(reading.pixels, true)
        own = apart.diagonal()
        t.errors.append(own[reading.seen])
        t.guesses.append(own[~reading.seen])
        off = reading.seen & (own > WRONG_PX)
        t.wrong += int(off.sum())
        t.swapped += int((off & (apart.argmin(1) != np.arange(MARK_COUNT))).sum())
    return t


def _blobs(frame: U8) -> F64:
    """(n, 2) centres [px], as OpenCV's own tools find them."""
    mask = cv2.inRange(cv2.cvtColor(frame, cv2.COLOR_BGR2HSV), np.array((38, 80, 40)), np.array((92, 255, 255)))
    p = cv2.SimpleBlobDetector.Params()
    p.filterByColor, p.blobColor, p.filterByArea, p.minArea, p.maxArea = True, 255, True, 40.0, 2000.0
    p.filterByCircularity = p.filterByConvexity = p.filterByInertia = False
    return np.array([k.pt for k in cv2.SimpleBlobDetector.create(p).detect(mask)]).reshape(-1, 2)


def _apart(a: F64, b: F64) -> F64:
    return np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1))


def _simulated_eye() -> Iterator[Row]:
    """Gaze and blinks of a drawn eye whose truth is known."""
    eye, seconds = EyePicture(SEED), 20.0
    pupils: list[F64] = []
    heights: list[float] = []
    for n, target in enumerate(GAZE_TARGETS):
        reader = EyeReader()
        readings = [reader.read(eye.draw(target, 1.0, 20 * n + k)) for k in range(12)]
        pupils.append(np.array([r.pupil.centre for r in readings if r.pupil is not None]).reshape(-1, 2))
        heights += [r.opening_px for r in readings if r.pupil is not None]
    reader = EyeReader(calibrate_gaze(pupils, GAZE_TARGETS, (WIDTH, HEIGHT), float(np.median(heights))))
    errors: list[float] = []
    openings: list[float] = []
    ms: list[float] = []
    for k in range(int(seconds * RATE_HZ)):
        t = k / RATE_HZ
        gaze = np.array((0.25 * np.sin(0.9 * t), 0.17 * np.sin(0.53 * t)))
        opening = 1.0 - max(0.0, float(np.sin(np.pi * (t % 2.5) / 0.25))) if t % 2.5 < 0.25 else 1.0
        picture = eye.draw(gaze, opening, k, 1.0 + 0.1 * float(np.sin(t)), 1.0 + 0.15 * float(np.sin(0.4 * t)))
        began = time.thread_time()
        reading = reader.read(picture)
        ms.append(1e3 * (time.thread_time() - began))
        openings.append(abs(reading.opening - opening))
        if reading.gaze is not None:
            errors.append(float(np.degrees(np.hypot(*(reading.gaze - gaze)))))
    case = "eye, simulated, 320x240"
    yield Row("face", case, "gaze error, median", "deg", float(np.median(errors)))
    yield Row("face", case, "gaze error p95", "deg", float(np.percentile(errors, 95)))
    yield Row("face", case, "lid opening error, mean", "1", float(np.mean(openings)))
    yield Row("face", case, "time per frame", "ms", float(np.median(ms)))


def _real_eyes() -> Iterator[Row]:
    if not DATA.is_dir():
        print(f"face: no real pictures of eyes at {DATA}; their rows are left out", file=sys.stderr)
        return
    boxes = {
        line.split()[0].removeprefix("open/"): np.array([float(v) for v in line.split()[2:6]])
        for line in (DATA / "open_bbox.txt").read_text("utf-8").splitlines()
    }
    with (Path(__file__).with_name("eye_pupils.csv")).open(encoding="utf-8") as f:
        pupils = {row["picture"]: np.array((float(row["x"]), float(row["y"]))) for row in csv.DictReader(f)}
    ours, peers, by_box = (
        {n: f(n) for n in pupils}
        for f in (
            lambda n: _hit(n, boxes[n], pupils[n], _pupil),
            lambda n: _hit(n, boxes[n], pupils[n], _hough),
            lambda n: _hit(n, boxes[n], boxes[n][:2] + 0.5 * boxes[n][2:], _pupil),
        )
    )
    groups = {
        "all": list(pupils),
        "people it was made on": [n for n in pupils if n.startswith(MADE_ON)],
        "other people": [n for n in pupils if not n.startswith(MADE_ON)],
    }
    for name, members in groups.items():
        found, peer = (100.0 * float(np.mean([hits[n] for n in members])) for hits in (ours, peers))
        target = at_least(95) if name == "all" else None
        yield Row("face", f"real open eyes, {name}: {len(members)}", "pupil found", "%", found, _HOUGH, peer, target=target)
    loose = 100.0 * float(np.mean(list(by_box.values())))
    yield Row("face", f"real open eyes, all: {len(pupils)}", "near the box's middle", "%", loose)
    closed = sorted((DATA / "closed").glob("*.jpg"))
    told = 100.0 * float(np.mean([_pupil(_grey(p)) is None for p in closed]))
    yield Row("face", f"real closed eyes: {len(closed)}", "told closed", "%", told, target=at_least(95))
    ms = [_timed(_grey(DATA / "open" / n)) for n in pupils]
    yield Row("face", f"real open eyes, all: {len(pupils)}", "search of a whole picture", "ms", float(np.median(ms)))


def _hit(name: str, box: F64, true: F64, find: Callable[[U8], F64 | None]) -> bool:
    found = find(_grey(DATA / "open" / name))
    return found is not None and float(np.hypot(*(found - true))) <= NEAR * 0.5 * float(box[2:].max())


def _pupil(picture: U8) -> F64 | None:
    p = find_pupil(picture)
    return p.centre if p is not None and p.confidence > LEAST_CONFIDENCE else None


def _hough(picture: U8) -> F64 | None:
    longer = max(picture.shape)
    calm = cv2.medianBlur(picture, 7)
    circles = cv2.HoughCircles(
        calm, cv2.HOUGH_GRADIENT, 1.5, longer / 8, param1=80, param2=30, minRadius=int(0.02 * longer), maxRadius=int(0.13 * longer)
    )
    return None if circles is None else np.asarray(circles[0, 0, :2], np.float64)


def _timed(picture: U8) -> float:
    began = time.thread_time()
    find_pupil(picture)
    return 1e3 * (time.thread_time() - began)


def _grey(path: Path) -> U8:
    return np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8)


def _rms(errors: F64) -> float:
    return float(np.sqrt((errors**2).mean()))

"""What a receiver's filter costs in time and gives in calm: recorded heads and hands through a FASTRAK's noise.

The recordings (../shared/data/sensor/vr: a headset and two hand controllers, 90 Hz) are those that nothing of the filter was tuned
or chosen on. Each is sampled 30 times a second, as a station of four is, and looked at 60 times a second. Beside them stand a still
receiver, and a made-up hand that is moved 150 mm within 140 ms. The peer is the One-Euro filter as published, applied to positions:
as calm at rest as ours, with the gain that gives it the least error on these recordings.
"""

import errno
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.row import Row, at_most, ratio_at_most
from vistel.arrays import F64
from vistel.capture.one_euro import PoseFilter
from vistel.geometry.rotation import (
    matrix_from_quaternion,
    matrix_from_rotvec,
    multiply,
    quaternion_from_matrix,
    rotation_x,
    rotation_y,
    rotation_z,
    rotvec_from_matrix,
    slerp,
)
from vistel.geometry.smoothstep import ease

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "sensor" / "vr"
RECORDINGS = ("tracked-recording", "dev-recording")
SAMPLES_HZ, SHOWN_HZ = 30.0, 60.0
NOISE_M, NOISE_RAD = 0.0008, math.radians(0.15)
STILL = np.array([0.0, 0.0, 0.0, 1.0])
MOVING = 0.3
"""Faster than this, something moves [m/s]."""
LAGS_S = np.arange(-0.02, 0.08, 0.001)
MOVED_M, MOVED_RAD, MOVE_S, EVERY_S = 0.15, 0.6, 0.14, 1.237
PEER = "One-Euro filter (Casiez 2012)"
GAINS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Of the peer's cut-off with speed, of which the best is taken [Hz per m/s]."""
Pose = tuple[F64, F64]


@dataclass(frozen=True)
class Track:
    """A pose at any time between 0 and `duration_s`: position (3,) [m], quaternion (4,)."""

    name: str
    duration_s: float
    at: Callable[[float], Pose]


@dataclass(frozen=True)
class Shown:
    """What a filter gave: times (n,) [s], positions (n, 3) [m], rotations (n, 4)."""

    times: F64
    position: F64
    rotation: F64


class OneEuro:
    """The peer, for positions (3,) [m]; its authors' cut-off of the speed, 1 Hz."""

    def __init__(self, cutoff_hz: float, gain: float) -> None:
        self._cutoff_hz, self._gain = cutoff_hz, gain
        self._t, self._p, self._v = -1.0, np.zeros(3), np.zeros(3)

    def update(self, t: float, p: F64, q: F64) -> None:
        """Take a sample; rotations are not filtered."""
        if self._t < 0.0:
            self._p = p
        else:
            dt = t - self._t
            self._v = self._v + _share(1.0, dt) * ((p - self._p) / dt - self._v)
            self._p = self._p + _share(self._cutoff_hz + self._gain * float(np.linalg.norm(self._v)), dt) * (p - self._p)
        self._t = t

    def at(self, t: float) -> Pose:
        """The last sample's: it predicts nothing."""
        return self._p, STILL


def rows() -> Iterator[Row]:
    """The recordings, a still receiver and a sudden move."""
    if not DATA.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no recordings", str(DATA))
    tracks = [track for name in RECORDINGS for track in _recorded(name)]
    still = Track("still", 100.0, lambda t: (np.zeros(3), STILL))
    ours = _through(PoseFilter(), still)
    calm = _trembling(ours)
    cutoff_hz = _as_calm(calm, still)
    gain = min(GAINS, key=lambda g: sum(_errors(t, _through(OneEuro(cutoff_hz, g), t))[0] for t in tracks))
    makers = PoseFilter, lambda: OneEuro(cutoff_hz, gain)
    yield Row("posture", "receiver: still", "position, rms of an axis", "mm", 1e3 * calm, target=at_most(0.47))
    spun = [rotvec_from_matrix(matrix_from_quaternion(q)) for q in ours.rotation]
    yield Row(
        "posture", "receiver: still", "rotation, rms of an axis", "deg", math.degrees(float(np.std(spun))), target=at_most(0.09)
    )
    found, peer = (np.nanmean([_errors(t, _through(make(), t)) for t in tracks], axis=0) for make in makers)
    for k, (metric, unit) in enumerate((("error, rms", "mm"), ("error while moving, p95", "mm"), ("lag while moving", "ms"))):
        target = at_most(3.0) if unit == "ms" else ratio_at_most(1.0)
        yield Row(
            "posture", "receiver: recorded heads and hands", metric, unit, float(found[k]), PEER, float(peer[k]), target=target
        )
    moved = Track("moved", 60 * EVERY_S, _moved)
    (late, beyond), (late_peer, beyond_peer) = (_sudden(_through(make(), moved)) for make in makers)
    sudden = "receiver: moved by 150 mm within 140 ms"
    for q, limit in ((50, 15.0), (95, 25.0)):
        value, other = (1e3 * float(np.percentile(x, q)) for x in (late, late_peer))
        yield Row("posture", sudden, f"half-way is shown after, p{q}", "ms", value, PEER, other, target=at_most(limit))
    value, other = (1e3 * float(np.median(x)) for x in (beyond, beyond_peer))
    yield Row("posture", sudden, "beyond where it stops, median", "mm", value, PEER, other, target=at_most(25.0))


def _through(receiver: PoseFilter | OneEuro, track: Track, seed: int = 1) -> Shown:
    """A track, measured with noise, as the filter shows it."""
    rng = np.random.default_rng(seed)
    times = list[float]()
    poses = list[Pose]()
    for k in range(int(track.duration_s * SHOWN_HZ)):
        t = k / SHOWN_HZ
        if k % round(SHOWN_HZ / SAMPLES_HZ) == 0:
            p, q = track.at(t)
            turned = multiply(matrix_from_rotvec(NOISE_RAD * rng.standard_normal(3)), matrix_from_quaternion(q))
            receiver.update(t, p + NOISE_M * rng.standard_normal(3), quaternion_from_matrix(turned))
        if t >= 1.0:
            times.append(t)
            poses.append(receiver.at(t))
    return Shown(np.array(times), np.array([p for p, _ in poses]), np.array([q for _, q in poses]))


def _trembling(shown: Shown) -> float:
    return float(np.std(shown.position))


def _as_calm(wanted: float, still: Track) -> float:
    """The peer's cut-off with which it trembles as much [Hz]."""
    low, high = 0.05, 15.0
    for _ in range(12):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if _trembling(_through(OneEuro(middle, 0.0), still)) > wanted else (middle, high)
    return low


def _errors(track: Track, shown: Shown) -> tuple[float, float, float]:
    """Error, rms, and p95 while it moves [mm]; lag while it moves [ms], nan where it hardly does."""
    true = np.array([track.at(t)[0] for t in shown.times])
    off = np.linalg.norm(shown.position - true, axis=1)
    moving = np.linalg.norm(np.gradient(true, shown.times, axis=0), axis=1) > MOVING
    rms = 1e3 * float(np.sqrt(np.mean(off**2)))
    if np.count_nonzero(moving) < SHOWN_HZ:
        return rms, math.nan, math.nan
    at = shown.times[moving]
    ends = np.stack([[track.at(min(track.duration_s, max(0.0, t - lag)))[0] for t in at] for lag in LAGS_S])
    squares = np.mean(np.sum((shown.position[moving] - ends) ** 2, axis=2), axis=1)
    return rms, 1e3 * float(np.percentile(off[moving], 95)), 1e3 * float(LAGS_S[int(np.argmin(squares))])


def _sudden(shown: Shown) -> tuple[list[float], list[float]]:
    """How long after the middle of each move half of it is shown [s], and how far beyond its end it comes [m]."""
    late, beyond = list[float](), list[float]()
    for number in range(2, int(shown.times[-1] / EVERY_S) - 1):
        there = (shown.times > (number - 0.2) * EVERY_S) & (shown.times < (number + 0.45) * EVERY_S)
        share = shown.position[there, 1] / MOVED_M
        share = share if number % 2 else 1.0 - share
        late.append(float(shown.times[there][int(np.argmax(share >= 0.5))]) - number * EVERY_S)
        beyond.append(MOVED_M * max(0.0, float(share.max()) - 1.0))
    return late, beyond


def _moved(t: float) -> Pose:
    """To and fro, half-way at each multiple of EVERY_S."""
    number, since = divmod(t + 0.5 * MOVE_S, EVERY_S)
    u = ease(min(1.0, since / MOVE_S))
    u = u if int(number) % 2 else 1.0 - u
    return np.array([0.0, MOVED_M * u, 0.0]), quaternion_from_matrix(rotation_x(MOVED_RAD * u))


def _recorded(name: str) -> Iterator[Track]:
    """Head and hands of a recording."""
    devices = json.loads((DATA / f"{name}.json").read_text("utf-8"))
    for device in ("camera", "left", "right"):
        poses = devices[device]["poses"]
        times = np.array([p["timestamp"] for p in poses]) * 1e-3
        kept = np.r_[True, np.diff(times) > 1e-4]
        position = np.array([[p["position"][axis] for axis in "xyz"] for p in poses])
        rotation = [quaternion_from_matrix(_turned(*(math.radians(p["rotation"][axis]) for axis in "xyz"))) for p in poses]
        yield _between(f"{name} {device}", times[kept] - times[0], position[kept], np.array(rotation)[kept])


def _turned(x: float, y: float, z: float) -> F64:
    """A-Frame's order: about Y, then X, then Z."""
    return multiply(multiply(rotation_y(y), rotation_x(x)), rotation_z(z))


def _between(name: str, times: F64, position: F64, rotation: F64) -> Track:
    def at(t: float) -> Pose:
        k = min(len(times) - 2, max(0, int(np.searchsorted(times, t)) - 1))
        u = (t - times[k]) / (times[k + 1] - times[k])
        return (1.0 - u) * position[k] + u * position[k + 1], slerp(rotation[k], rotation[k + 1], u)

    return Track(name, float(times[-1]), at)


def _share(cutoff_hz: float, dt: float) -> float:
    r = 2.0 * math.pi * cutoff_hz * dt
    return r / (r + 1.0)

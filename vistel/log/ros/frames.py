"""Frames of a bag as sensors on people: who wears which, and where each frame is in the frame that all are measured in."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.log.ros.bag import Bag, Transforms
from vistel.log.sensors import APART_S, LONGEST_S, SENSORS, UNITS, SensorError, Take, Track, check_height

AXES: Mapping[str, F64] = {"y": np.eye(3), "z": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])}
"""From a bag's axes to those of a seat, of the room as of each frame. z: REP 103, x forward, y to the left, z up."""
MOST_GAP_S = 0.5
"""Between two transforms that are farther apart, a frame is not known [s]."""
_WORN = re.compile(rf"(?:(.+)/)?({'|'.join(SENSORS)})")


def people_of(bag: Bag, chosen: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Of each person the frame of each sensor. chosen: of one person, in place of what frames are called: `head`, `ann/head`. The
    name is "" where frames do not say it. Raises SensorError where nobody wears anything, or a chosen frame never comes."""
    names = {name for link in bag.transforms for name in (link.parent, link.child)}
    if chosen:
        for sensor, frame in chosen.items():
            if frame.lstrip("/") not in names:
                raise SensorError(f"{bag.path}: the frame {frame} for {sensor} never comes; it has {_listed(names)}")
        return {"": {sensor: frame.lstrip("/") for sensor, frame in chosen.items()}}
    people: dict[str, dict[str, str]] = {}
    for name in sorted(names):
        if worn := _WORN.fullmatch(name):
            people.setdefault(worn[1] or "", {})[worn[2]] = name
    if not people:
        wanted = ", ".join(SENSORS)
        raise SensorError(
            f"{bag.path}: no frame is called {wanted}; it has {_listed(names)}; say which is which: --frame head=FRAME"
        )
    return people


def take_of(bag: Bag, worn: Mapping[str, str], unit: str = "m", up: str = "z") -> Take:
    """The sensors of a person. worn: the frame of each; unit: of positions, a name of `UNITS`; up: an axis of `AXES`. Raises
    SensorError: for frames that form a loop, that are not measured in one frame, or that are where nobody is."""
    above = _above(bag)
    chains = {sensor: _chain(bag.path, above, frame) for sensor, frame in worn.items()}
    roots = {frames[-1] for frames in chains.values()}
    if len(roots) > 1:
        raise SensorError(
            f"{bag.path}: {', '.join(worn.values())} are not measured in one frame, but in {' and in '.join(sorted(roots))}"
        )
    axes = AXES[up]
    tracks: dict[str, Track] = {}
    back = 0
    for sensor, frames in chains.items():
        links = [_ordered(above[frame]) for frame in frames[:-1]]
        back += sum(times_back for _, times_back in links)
        t, p, r = _composed(bag.path, worn[sensor], [link for link, _ in links])
        tracks[sensor] = Track(t, UNITS[unit] * p @ axes.T, axes @ r @ axes.T)
    _check_times(bag.path, tracks)
    return Take(tracks, back, check_height(bag.path, tracks, unit, up))


def _above(bag: Bag) -> dict[str, Transforms]:
    """The transform of each frame to the one that it is in. Raises SensorError for a frame that is in two."""
    above: dict[str, Transforms] = {}
    for link in bag.transforms:
        other = above.setdefault(link.child, link)
        if other.parent != link.parent:
            raise SensorError(
                f"{bag.path}: the frame {link.child} is in two others: {' and '.join(sorted((other.parent, link.parent)))}"
            )
        if other.fixed and not link.fixed:
            above[link.child] = link
    return above


def _chain(path: Path, above: Mapping[str, Transforms], frame: str) -> list[str]:
    """A frame and those that it is in, the outermost last."""
    chain = [frame]
    while (link := above.get(chain[-1])) is not None:
        if link.parent in chain:
            loop = [*chain[chain.index(link.parent) :], link.parent]
            raise SensorError(f"{path}: frames are in each other, in a loop: {' in '.join(loop[:8])}")
        chain.append(link.parent)
    if len(chain) == 1:
        raise SensorError(f"{path}: nothing says where the frame {frame} is: it is only what others are measured in")
    return chain


def _ordered(link: Transforms) -> tuple[Transforms, int]:
    """Transforms in the order of their times, each time once, and how often time went back. Of a fixed one the last."""
    if link.fixed:
        return Transforms(link.parent, link.child, True, link.t[-1:], link.p[-1:], link.q[-1:]), 0
    t = np.array(link.t)
    sort = np.argsort(t, kind="stable")
    order: list[int] = sort[np.append(np.diff(t[sort]) > 0.0, True)].tolist()
    p, q = [link.p[k] for k in order], [link.q[k] for k in order]
    kept = Transforms(link.parent, link.child, False, [link.t[k] for k in order], p, q)
    return kept, int(np.count_nonzero(np.diff(t) < 0.0))


def _composed(path: Path, frame: str, links: Sequence[Transforms]) -> tuple[F64, F64, F64]:
    """When (N,) a frame was where (N, 3), and its rotation (N, 3, 3), in the outermost frame: at the times of the link that says
    most, where all others are known."""
    moving = [link for link in links if not link.fixed]
    if not moving:
        raise SensorError(f"{path}: the frame {frame} never moves: it is only in tf_static")
    t = np.array(max(moving, key=lambda link: len(link.t)).t)
    for link in moving:
        known = np.array(link.t)
        after = np.clip(np.searchsorted(known, t), 1, max(1, len(known) - 1))
        gap = known[np.minimum(after, len(known) - 1)] - known[after - 1]
        t = t[(t >= known[0]) & (t <= known[-1]) & ((gap <= MOST_GAP_S) | np.isin(t, known))]
    if len(t) < 2:
        raise SensorError(f"{path}: the frame {frame} is known at {len(t)} times, expected at least 2")
    p, r = np.zeros((len(t), 3)), np.broadcast_to(np.eye(3), (len(t), 3, 3))
    for link in links:  # from the frame outwards
        where, turn = _at(link, t)
        p, r = where + np.einsum("nij,nj->ni", turn, p), turn @ r
    return t, p, r


def _at(link: Transforms, t: F64) -> tuple[F64, F64]:
    """A link at some times within its own: between two transforms the place, and the quaternion, in a straight line."""
    known, p, q = np.array(link.t), np.array(link.p), np.array(link.q)
    if len(known) == 1:
        return np.repeat(p, len(t), axis=0), np.repeat(matrix_from_quaternion(q[0])[None], len(t), axis=0)
    flips = np.cumprod(np.append(1.0, np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0)))
    q = q * flips[:, None]  # of the two quaternions of a rotation the one near the last
    turned = np.stack([np.interp(t, known, q[:, k]) for k in range(4)], axis=1)
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    where = np.stack([np.interp(t, known, p[:, k]) for k in range(3)], axis=1)
    return where, np.array([matrix_from_quaternion(one) for one in turned])


def _check_times(path: Path, tracks: Mapping[str, Track]) -> None:
    apart = float(np.median(np.concatenate([np.diff(track.t) for track in tracks.values()])))
    length = max(float(track.t[-1]) for track in tracks.values()) - min(float(track.t[0]) for track in tracks.values())
    if not APART_S[0] <= apart <= APART_S[1] or length > LONGEST_S:
        raise SensorError(f"{path}: stamps are {apart:g} s apart, {length:g} s in all, expected 1 Hz to 2000 Hz and at most a day")


def _listed(names: set[str]) -> str:
    return ", ".join(sorted(names)[:8]) + (", ..." if len(names) > 8 else "")

"""Thinned lines as curves: paths between their ends and forks."""

from collections import defaultdict

import numpy as np

from vistel.arrays import F64, U8

Pixel = tuple[int, int]

_AROUND = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]


def paths(skeleton: U8, shortest: float) -> list[F64]:
    """(N, 2) rows and columns of each curve of a skeleton one pixel wide; curves that meet have their last point in common.
    Curves with a free end that are shorter than `shortest` pixels are removed; the two that are left at a fork become one curve."""
    pixels = {(int(r), int(c)) for r, c in np.argwhere(skeleton)}
    while True:
        found = _traced(pixels)
        count = _meetings(found)
        short = [p for p in found if _length(p) < shortest and min(count[p[0]], count[p[-1]]) < 2]
        if not short:
            break
        # Of those at one fork only the shortest: another may then continue through the fork.
        touched: set[Pixel] = set()
        for path in sorted(short, key=_length):
            forks = {p for p in (path[0], path[-1]) if count[p] > 1}
            if not forks & touched:
                pixels -= (set(path) - forks) or set(path)
                touched |= forks
    centre = _forks(found)
    out: list[F64] = []
    for path in found:
        line = np.array(path, np.float64)
        line[0], line[-1] = centre.get(path[0], line[0]), centre.get(path[-1], line[-1])
        if len(line) > 2:
            out.append(line)
    return out


def _neighbours(pixel: Pixel, pixels: set[Pixel]) -> list[Pixel]:
    """Of a pixel: those beside it, and those across a corner that cannot be reached by one beside it."""
    r, c = pixel
    straight = [(r + i, c + j) for i, j in _AROUND if i * j == 0 and (r + i, c + j) in pixels]
    slanted = [
        (r + i, c + j)
        for i, j in _AROUND
        if i * j != 0 and (r + i, c + j) in pixels and (r + i, c) not in pixels and (r, c + j) not in pixels
    ]
    return straight + slanted


def _traced(pixels: set[Pixel]) -> list[list[Pixel]]:
    """Paths from end or fork to end or fork; closed curves from anywhere."""
    near = {p: _neighbours(p, pixels) for p in pixels}
    nodes = {p for p, n in near.items() if len(n) != 2}
    seen: set[frozenset[Pixel]] = set()
    out: list[list[Pixel]] = []
    for start in sorted(nodes) + sorted(pixels - nodes):
        for step in near[start]:
            if frozenset((start, step)) in seen or (start not in nodes and any(frozenset((start, n)) in seen for n in near[start])):
                continue
            path = [start, step]
            seen.add(frozenset(path))
            while path[-1] not in nodes and path[-1] != start:
                ahead = [n for n in near[path[-1]] if n != path[-2]]
                if not ahead:
                    break
                seen.add(frozenset((path[-1], ahead[0])))
                path.append(ahead[0])
            out.append(path)
    return out


def _meetings(found: list[list[Pixel]]) -> dict[Pixel, int]:
    count: dict[Pixel, int] = defaultdict(int)
    for path in found:
        count[path[0]] += 1
        count[path[-1]] += 1
    return count


def _length(path: list[Pixel]) -> float:
    return float(np.linalg.norm(np.diff(np.array(path, np.float64), axis=0), axis=1).sum())


def _forks(found: list[list[Pixel]]) -> dict[Pixel, F64]:
    """The place of each pixel of a fork: forks that are one step apart count as one."""
    count = _meetings(found)
    group: dict[Pixel, Pixel] = {p: p for p, n in count.items() if n > 1}

    def root(p: Pixel) -> Pixel:
        while group[p] != p:
            p = group[p]
        return p

    for path in found:
        if len(path) == 2 and path[0] in group and path[1] in group:
            group[root(path[0])] = root(path[1])
    members: dict[Pixel, list[Pixel]] = defaultdict(list)
    for p in group:
        members[root(p)].append(p)
    return {p: np.mean(np.array(all_of, np.float64), axis=0) for all_of in members.values() for p in all_of}

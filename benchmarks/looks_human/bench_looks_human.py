"""People: what detectors of faces, bodies and hands that others trained find in pictures of them, beside MakeHuman's.

Busts of the ten built-in people; everybody in twelve postures from three distances; the demo's table, and everybody in every seat
of it, through the eyes of the others. A face is found where the middle of one that scores 0.5 or more is within half its height; a
hand where one is found in a square of 2.2 times its length round it, as a detector looks that follows a body. Of landmarks count
joints that nothing hides, faces that are turned by less than 60° from the camera and whole, hands of 32 pixels and more.
"""

import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from statistics import mean, median
from typing import Any

import numpy as np
from PIL import Image

from benchmarks.looks_human.contrast import contrasts
from benchmarks.looks_human.detector import detected
from benchmarks.looks_human.frames import AWAY_M, LIGHTS, frames
from benchmarks.looks_human.makehuman import PEERS
from benchmarks.row import Row, Target, at_least, at_most, ratio_at_least
from vistel.figure.body_model.builtin_people import PEOPLE

SURE = 0.5
"""Least score of a face that is found: the detector's default."""
TURNED = 60.0
"""Faces turned farther from the camera do not count [degrees]."""
OPEN = 0.75
"""Least share of a face or hand that nothing hides, for it to count."""
HAND_PX = 32.0
"""Least length of a hand that counts."""
FACE_PX = 12.0
"""Least half height of a face whose contrast is measured."""
WITHIN = 3.0
"""How far a landmark may be from its joint [% of the body's height]."""
_FACES, _HANDS = at_least(98.0), at_least(90.0)
_SCORE, _ERROR = ratio_at_least(1.0), at_most(WITHIN)
_PEER = "MakeHuman's man and woman"
_BENCH = "looks_human"
Told = dict[str, Any]


def run(thorough: bool = False) -> Iterator[Row]:
    """Some five minutes, once everybody is made; `thorough`ly every posture from every distance in both lights."""
    with tempfile.TemporaryDirectory() as folder:
        drawn = frames(Path(folder), thorough)
        found = detected(Path(folder))
        for frame in drawn:
            frame["found"] = found[frame["file"]]
        yield from rows(drawn, Path(folder))


def rows(drawn: list[Told], folder: Path) -> Iterator[Row]:
    """Every figure. drawn: frames with what the detectors found; folder: where their files are."""
    for light in LIGHTS:
        yield from _busts([f for f in drawn if f["kind"] == "bust" and f["light"] == light], light)
    yield from _postures([f for f in drawn if f["kind"] == "posture"])
    for kind, case in (("demo", "the demo's table"), ("seats", "everybody in every seat")):
        for light in LIGHTS:
            frames_of = [f for f in drawn if f["kind"] == kind and f["light"] == light]
            seen = [(f, p) for f in frames_of for p in f["people"] if p["turned"] < TURNED and p["face_seen"] >= OPEN]
            found = [(p["whole"], face_score(f["found"]["far"], p["face"]) >= SURE) for f, p in seen]
            whole = [sure for is_whole, sure in found if is_whole]
            yield _share(f"{case}, {light} light, {len(whole)} faces", "faces found", whole, _FACES)
            yield _share(f"{case}, {light} light, {len(found)} faces", "the picture's edge over them too", [s for _, s in found])
            yield from _hands(f"{case}, {light} light", frames_of, [])
    for light in LIGHTS:
        yield from _contrasts([f for f in drawn if f["kind"] in ("demo", "seats") and f["light"] == light], light, folder)


def face_score(faces: Iterable[tuple[float, float, float, float, float]], true: tuple[float, float, float]) -> float:
    """Best score of the faces (score, x, y, w, h) that lie where one is, (x, y, half height); 0 where none does. Pixels."""
    x, y, half = true
    return max((s for s, left, top, w, h in faces if np.hypot(left + 0.5 * w - x, top + 0.5 * h - y) < half), default=0.0)


def landmark_errors(frame: Told) -> list[float]:
    """How far the landmarks of seen joints are from them [% of the body's height]; empty where no body is found."""
    (person,) = frame["people"]
    marks = frame["found"]["pose"]
    return [
        100.0 * float(np.hypot(*np.subtract(marks[int(k)][:2], at))) / person["stature"]
        for k, at in person["joints"].items()
        if marks and person["joints_seen"][k]
    ]


def _busts(drawn: list[Told], light: str) -> Iterator[Row]:
    scores: dict[str, list[float]] = defaultdict(list)
    for f in drawn:
        scores[f["who"]].append(face_score(f["found"]["near"], f["people"][0]["face"]))
    peers = [s for name in PEERS for s in scores.get(name, ())]
    beside = (_PEER, round(mean(peers), 3)) if peers else (None, None)
    for name in PEOPLE:
        yield Row(_BENCH, f"bust, {light} light", name, "score", round(mean(scores[name]), 3), *beside, target=_SCORE)


def _postures(drawn: list[Told]) -> Iterator[Row]:
    ours, peers = ([f for f in drawn if (f["who"] in PEERS) == theirs] for theirs in (False, True))

    def beside(metric: str, unit: str, of: Any, target: Target | None, case: str, some: list[Told], others: list[Told]) -> Row:
        peer = (_PEER, round(of(others), 3)) if others else (None, None)
        return Row(_BENCH, case, metric, unit, round(of(some), 3), *peer, target=target)

    def errors(some: list[Told]) -> list[float]:
        return [e for f in some for e in landmark_errors(f)]

    for away in AWAY_M:
        some, others = ([f for f in them if f["away"] == away] for them in (ours, peers))
        case = f"twelve postures, from {away} m, {len(some)} pictures"
        yield beside("bodies found", "%", lambda s: 100.0 * mean(bool(f["found"]["pose"]) for f in s), None, case, some, others)
        yield beside("landmarks from joints, mean", "% height", lambda s: mean(errors(s)), _ERROR, case, some, others)
        yield beside("landmarks from joints, median", "% height", lambda s: median(errors(s)), None, case, some, others)
        yield beside("within 3 %", "%", lambda s: 100.0 * mean(e <= WITHIN for e in errors(s)), None, case, some, others)
    yield from _hands("twelve postures", ours, peers)


def hands_found(drawn: list[Told]) -> list[bool]:
    """Of each hand that counts, whether it was found in its square."""
    return [
        found
        for f in drawn
        for hand, found in zip((h for p in f["people"] for h in p["hands"]), f["found"]["hands"], strict=True)
        if hand["long"] >= HAND_PX and hand["seen"] >= OPEN
    ]


def _hands(case: str, drawn: list[Told], others: list[Told]) -> Iterator[Row]:
    found, theirs = hands_found(drawn), hands_found(others)
    if found:
        peer = (_PEER, round(100.0 * mean(theirs), 1)) if theirs else (None, None)
        yield Row(_BENCH, f"{case}, {len(found)} hands", "hands found", "%", round(100.0 * mean(found), 1), *peer, target=_HANDS)


def _contrasts(drawn: list[Told], light: str, folder: Path) -> Iterator[Row]:
    """Of each feature, the contrast of those two people and seats that have the least and the middle one."""
    by_feature: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for f in drawn:
        picture = np.asarray(Image.open(folder / f["file"]).convert("RGB"))
        for p in f["people"]:
            half = p["face"][2]
            if p["whole"] and p["turned"] < TURNED and p["face_seen"] >= OPEN and half >= FACE_PX:
                told = contrasts(picture, np.array(p["eyes"]), half / 0.10)
                for feature, value in told.items():
                    by_feature[feature][f"{p['name']} from seat {f['seat']}"].append(value)
    for feature, values in by_feature.items():
        each = {who: mean(v) for who, v in values.items()}
        least = min(each, key=lambda who: each[who])
        yield Row(_BENCH, f"contrast with skin, {light} light", f"{feature}, least: {least}", "", round(each[least], 3))
        yield Row(_BENCH, f"contrast with skin, {light} light", f"{feature}, median", "", round(median(each.values()), 3))


def _share(case: str, metric: str, found: list[bool], target: Target | None = None) -> Row:
    return Row(_BENCH, case, metric, "%", round(100.0 * mean(found), 1), target=target)

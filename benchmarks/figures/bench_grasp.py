"""Taking hold: grasps of recorded hands that are found, false ones, how deep hands are in things, and the time.

Recordings that were held out at first are read from the folder in VISTEL_HELD_OUT_HANDS, if it is set (`grasp_held_out`).
"""

import errno
import time
from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks.figures import grasp_held_out as held_out
from benchmarks.figures import grasp_shapes as shapes
from benchmarks.figures import grasp_trials as trials
from benchmarks.figures.grasp_depth import deepest
from benchmarks.grasping import peers, sets
from benchmarks.grasping.trials import play
from benchmarks.row import Row, at_least, at_most
from benchmarks.scores import wilson
from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.dynamics.solids import solids
from vistel.space.hands.fitting import fit, hand_of
from vistel.space.room import meeting_room

SHAPES = 30
"""Things of each kind."""
LEAST_FOUND, MOST_FALSE, MOST_MM = at_least(95), at_most(2), at_most(1)


def run() -> Iterator[Row]:
    """Raises FileNotFoundError where the recordings are not there."""
    if not (trials.DATA / "hand").is_dir():
        raise FileNotFoundError(errno.ENOENT, "no recordings", str(trials.DATA / "hand"))
    true = [trials.run(t) for t in trials.true_trials()]
    false = [trials.run(t) for t in trials.false_trials()]
    row = partial(Row, "grasp")
    case = f"recorded hands, {len(true)} true and {len(false)} false grasps"
    found = 100.0 * np.mean([trials.found(r) for r in true])
    wrong = 100.0 * np.mean([r.took is not None for r in false])
    yield row(case, "true grasps found", "%", float(found), target=LEAST_FOUND)
    yield row(case, "false grasps", "%", float(wrong), target=MOST_FALSE)
    opened = [r for r in true if r.trial.opens is not None and r.took is not None]
    late = trials.LATE_S * trials.RATE_HZ
    let_go = 100.0 * np.mean([r.left is not None and r.left <= (r.trial.opens or 0) + late for r in opened])
    yield row(case, "releases found", "%", float(let_go), target=LEAST_FOUND)
    depths = np.array([_depth(r) for r in true if r.held is not None and r.posture is not None])
    yield row(case, "deepest finger, before", "mm", 1e3 * float(depths[:, 0].max()))
    worst = 1e3 * float(depths[:, 1].max())
    yield row(case, "deepest finger, held", "mm", worst, target=MOST_MM)
    touching = 100.0 * float(np.mean(depths[:, 2] >= 2))
    yield row(case, "two digits or more touch", "%", touching)
    if (trials.DATA / "body" / "kth_handover").is_dir():
        yield from _hand_over(row)
    yield from _perturbed(row, "other hands and things, recordings worked with", held_out.settled_on(), 2)
    if held_out.HELD_OUT is not None:
        yield from _perturbed(row, "other hands and things, recordings once held out", held_out.held_out(held_out.HELD_OUT), 1)
    for some in (sets.tune(), sets.choose(held_out.HELD_OUT)):
        yield from _set(row, some)
    yield from _shapes(row)
    yield row("laying a hand on a thing", "median processor time", "ms", _fit_ms())


def _set(row: partial[Row], some: sets.GraspSet) -> Iterator[Row]:
    """Simulated hands, and those of recordings; `report` is not among these: `benchmarks.grasping.report` opens it."""
    true, false = list(some.true_trials(1)), list(some.false_trials(1))
    ran, games = [play(t) for t in true], [peers.play(t) for t in true if t.things]
    taken, theirs = sum(play(t).took is not None for t in false), sum(peers.play(t).took is not None for t in false if t.things)
    found, peer = sum(r.found for r in ran), sum(r.found for r in games)
    opened = [r for r in ran if r.found and r.trial.opens is not None]
    released = sum(r.released for r in opened)
    for metric, hits, of, peer_value, target in (
        ("true grasps found", found, len(true), 100.0 * peer / len(games), LEAST_FOUND),
        ("false grasps", taken, len(false), 100.0 * theirs / sum(bool(t.things) for t in false), MOST_FALSE),
        ("releases found", released, len(opened), None, at_least(97)),
    ):
        low, high = wilson(hits, of)
        case = f"set {some.name}, {of} trials, 95 % interval {low:.1f} to {high:.1f} %"
        name = peers.NAME if peer_value is not None else None
        yield row(case, metric, "%", 100.0 * hits / max(1, of), name, peer_value, target=target)


def _perturbed(row: partial[Row], case: str, takes: held_out.Takes, each: int) -> Iterator[Row]:
    true = [trials.run(t) for t in held_out.true_trials(takes, each)]
    false = [trials.run(t) for t in held_out.false_trials(takes, each)]
    case = f"{case}, {len(true)} true and {len(false)} false grasps"
    found = 100.0 * float(np.mean([trials.found(r) for r in true]))
    wrong = 100.0 * float(np.mean([r.took is not None for r in false]))
    yield row(case, "true grasps found", "%", found, target=LEAST_FOUND)
    yield row(case, "false grasps", "%", wrong, target=MOST_FALSE)
    out = float(held_out.left_out(takes))
    yield row(case, "closings the tracker was not sure of or too brief, left out", "", out)


def _shapes(row: partial[Row]) -> Iterator[Row]:
    """All kinds of primitives and several of them, where the thing may be moved and where the hand gives way."""
    hands = np.concatenate([f[s > trials.CLOSED][::7] for f, s in _closed()])
    for free, what in ((True, "the thing is brought into line"), (False, "the hand gives way")):
        case = f"hands of 85 to 115 % on {6 * SHAPES} things of every kind, {what}"
        some = list(shapes.laid(hands, np.random.default_rng(23), SHAPES, free=free))
        worst = 1e3 * max(r.after for r in some)
        yield row(case, "deepest point as they come", "mm", 1e3 * max(r.before for r in some))
        yield row(case, "deepest point as they hold", "mm", worst, target=MOST_MM)
        more = 100.0 * float(np.mean([r.touching >= 2 for r in some]))
        yield row(case, "two digits or more touch", "%", more)


def _closed() -> list[tuple[F64, F64]]:
    """Recorded fingers and how far each hand is closed: those once held out where their folder is named."""
    if held_out.HELD_OUT is not None:
        takes = held_out.held_out(held_out.HELD_OUT)
        return [trials.recording(t.path, t.left)[:2] for t in takes.grabs]
    fingers, grab, _ = trials.recorded("grab")
    return [(fingers, grab)]


def _hand_over(row: partial[Row]) -> Iterator[Row]:
    h = trials.hand_over()
    right, case = h.truth & h.sure, "recorded hand-over, frames of four hands"
    found = 100.0 * float((h.said & right).sum() / right.sum())
    none = ~h.truth & h.sure
    wrong = 100.0 * float((h.said & none).sum() / none.sum())
    yield row(case, "holding found", "%", found, target=LEAST_FOUND)
    yield row(case, "holding said falsely", "%", wrong, target=MOST_FALSE)


def _depth(ran: trials.Ran) -> tuple[float, float, int]:
    """How deep the hand was in the thing it holds [m] with the recorded fingers and as it is seen, by samples of its
    surface; how many digits touch."""
    assert ran.held is not None and ran.posture is not None
    grasp = next(g for g in ran.held.grasps if g.thing == ran.trial.thing)
    thing = next(t for t in ran.held.things if t.id == ran.trial.thing)
    hand = hand_of(trials.BUILD, True)
    pose = grasp.position, matrix_from_quaternion(grasp.rotation)
    before, _ = deepest(hand.placed(ran.posture.hands[1]), hand.digit, thing, *pose)
    after, near = deepest(hand.placed(grasp.fingers), hand.digit, thing, *pose)
    return before, after, near


def _fit_ms() -> float:
    room = meeting_room(3)
    s, took = solids(room.things), []
    fingers, _, _ = trials.recorded("grab")
    for n, thing in enumerate(room.things):
        if thing.fixed:
            continue
        lying = s.part(n).moved(np.eye(3), trials.BUILD.palm[1] - np.array([0.0, 0.02, 0.0]))
        for _ in range(5):
            began = time.process_time()
            fit(trials.BUILD, True, fingers[40], (True,) * 4, lying, to_palm=True)
            took.append(time.process_time() - began)
    return 1e3 * float(np.median(took))

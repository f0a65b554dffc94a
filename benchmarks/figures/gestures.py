"""How often recorded people who signal nothing hold what counts as a signal (`vistel.space.gestures`): one line a recording.

Bodies: ../shared/data/body (two of CMU's motions, a hand-over of KTH's). Hands: ../shared/data/hand/leap; these say nothing of
where a thumb points, so that every fist with a straight thumb counts.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.figures.bench_posture import recordings
from benchmarks.leap import finger_angles
from vistel.figure.skeleton import JOINT_INDEX
from vistel.space.gestures import EVERY, STEPS, THUMB, UP, fists_with_thumbs, hands_above
from vistel_sim.motion.recording import RECORDED, SIDES, Recording

HANDS = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "hand" / "leap"
STEPS_HZ = 60.0


def lines() -> Iterator[str]:
    """One for each recording: its length, how long a hand was above the head, and how many signals that made."""
    for recording in recordings():
        yield _line(recording.name, UP, _above(recording))
    for path in sorted(HANDS.glob("*.lz")):
        for left in (False, True):
            try:
                angles = finger_angles(path, STEPS_HZ / EVERY, left)
            except (ValueError, IndexError):
                continue  # that hand was not seen
            yield _line(f"{path.stem} {SIDES[not left]}", THUMB, [fists_with_thumbs(np.stack([row, row]))[0] for row in angles])


def _above(recording: Recording) -> list[bool]:
    """Whether just one hand is above the head, ten times a second. Knuckles are where the person's bones put them."""
    skeleton = recording.measured()
    at = np.arange(0.0, recording.duration_s, EVERY / STEPS_HZ)
    out: list[bool] = []
    for frame in np.round(at * recording.rate_hz).astype(int):
        position = np.zeros_like(skeleton.rest)
        for name in RECORDED:
            if name in JOINT_INDEX:
                position[JOINT_INDEX[name]] = recording.joint(name)[0][frame]
        for side in SIDES:
            p, turn = (values[frame] for values in recording.joint(f"{side}_hand"))
            position[JOINT_INDEX[f"{side}_middle_proximal"]] = p + turn @ skeleton.tip[JOINT_INDEX[f"{side}_hand"]]
        left, right = hands_above(skeleton, position)
        out.append(left != right)
    return out


def signals_in(held: Sequence[bool], kind: str) -> list[int]:
    """At which looks a signal counts, ten looks a second. held: whether it is held at each of them."""
    run, out = 0, list[int]()
    for n, now in enumerate(held):
        run = run + 1 if now else 0
        if run == STEPS[kind] // EVERY + 1:
            out.append(n)
    return out


def _line(name: str, kind: str, held: Sequence[bool]) -> str:
    seconds, count = len(held) * EVERY / STEPS_HZ, len(signals_in(held, kind))
    return f"{name:40} {kind:6} {seconds:6.1f} s, held {sum(held) * EVERY / STEPS_HZ:5.1f} s, signals {count}"


if __name__ == "__main__":
    for line in lines():
        print(line)

"""How fast somebody's hand moves in a log, as a table that a spreadsheet opens.

python examples/02_measure_a_motion.py out/latest/conference.mcap aiko > aiko.csv
"""

import sys

import numpy as np

import vistel.log
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton

HEIGHT_M = 1.7


def main(path: str, participant: str) -> None:
    """Print time [s], place [m, room frame] and speed [m/s] of the left hand, ten times a second."""
    skeleton, hand = standard_skeleton(HEIGHT_M), JOINT_INDEX["left_hand"]
    print("t,x,y,z,speed")
    before: tuple[float, np.ndarray] | None = None
    for t, posture in vistel.log.open(path).postures(participant):
        if before is not None and t - before[0] < 0.1:
            continue
        place = pose_joints(skeleton, posture).position[hand]
        speed = 0.0 if before is None else float(np.linalg.norm(place - before[1])) / (t - before[0])
        print(f"{t:.3f},{place[0]:.4f},{place[1]:.4f},{place[2]:.4f},{speed:.3f}")
        before = t, place


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])

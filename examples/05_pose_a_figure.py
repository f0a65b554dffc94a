"""Pose one of the built-in people and draw them.

python examples/05_pose_a_figure.py ben.png
"""

import sys

import vistel.figure
import vistel.render


def main(picture: str) -> None:
    """Ben, his left elbow bent by 90 degrees and his head turned."""
    ben = vistel.figure.builtin("ben").pose(left_lower_arm=90, head=(0, 25, 0))
    vistel.render.picture([ben], size=(640, 480)).save(picture)
    print(picture)


if __name__ == "__main__":
    main(sys.argv[1])

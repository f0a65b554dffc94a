"""Compiles the kernels of posture, for all processes to come: `python -m vistel.figure.posture.warm_up`.

They need NumPy, SciPy and Numba alone, so set-up compiles them on the second core while it fetches other packages.
"""

from vistel.figure.posture.posture import pose_joints, standing
from vistel.figure.posture.solve import PostureSolver
from vistel.figure.skeleton import standard_skeleton


def warm_up() -> None:
    """Pose and solve once."""
    skeleton = standard_skeleton()
    pose_joints(skeleton, standing())
    PostureSolver(skeleton).solve(0.0, {})


if __name__ == "__main__":
    warm_up()

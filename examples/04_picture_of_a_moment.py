"""What a site saw at a moment of a recorded conference, as a picture.

python examples/04_picture_of_a_moment.py out/latest/conference.mcap 8.5 moment.png
"""

import sys

import vistel.log


def main(path: str, at: float, picture: str) -> None:
    """Draw the log at `at` seconds through the eyes of its first site."""
    vistel.log.open(path).picture(at, size=(640, 360)).save(picture)
    print(picture)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), sys.argv[3])

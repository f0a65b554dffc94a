"""Makes a built-in person and its figure, and keeps them on disk, where a renderer reads them.

python -m vistel.render.figures.make_person SPEC NAME HEIGHT PARENT

Ends when the process PARENT does.
"""

import sys

from vistel.render.figures.people import load_figure
from vistel.render.stage.stage import ParticipantInfo
from vistel.wire import alive


def main() -> None:
    """Make the person of the command line."""
    spec, name, height, parent = sys.argv[1:]
    alive.end_with(int(parent))
    load_figure(ParticipantInfo(name, name, spec, float(height)))


if __name__ == "__main__":
    main()

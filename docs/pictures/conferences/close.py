"""Draws hand-on-ball.png and handshake.png: a hand on what it holds and two hands in each other, in fine light.

    python -m docs.pictures.conferences.close [hand-on-ball] [handshake]

As the renderer shows them: a world says what touches and what is held, skins give way. Needs an OpenGL context (software is fine).
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from docs.pictures.conferences.scenes import SCENES, photograph

SIZE = (640, 360)


def main() -> None:
    for name in sys.argv[1:] or ("hand-on-ball", "handshake"):
        picture = photograph(SCENES[name](), *SIZE)
        out = Image.fromarray(np.ascontiguousarray(picture))
        out.save(Path(__file__).parent / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()

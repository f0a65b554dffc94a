"""Ray trace two soft bodies that press against each other.

python examples/09_trace_a_field.py pressed.png
"""

import sys
from pathlib import Path

import vistel.implicit as vi
from vistel.implicit.ghosts.composition import collisions, deformed
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.scene import Camera, Light, Material, Scene, write_png
from vistel.implicit.trace import render


def main(picture: str) -> None:
    """Two balls that overlap share a flat contact; the blue one is softer and gives way more."""
    hard = Deformable("hard", vi.Sphere((0, 0, 0), 1.0), compliance=0.4)
    soft = Deformable("soft", vi.Sphere((0, 0, 0), 1.0), position=(1.0, 0, 0))
    shapes = deformed([hard, soft], collisions([hard, soft]))
    red = Material(colour=(0.80, 0.36, 0.30)).on(shapes["hard"])
    blue = Material(colour=(0.33, 0.50, 0.76)).on(shapes["soft"])
    scene = Scene(shape=red | blue, camera=Camera((0.45, 1.2, 3.2), (0.45, 0, 0)), lights=(Light(position=(3, 6, 5)),))
    write_png(Path(picture), render(scene, size=(480, 320), antialias=0.1).light)
    print(picture)


if __name__ == "__main__":
    main(sys.argv[1])

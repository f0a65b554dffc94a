"""Write a built-in person as GLB, which Blender and game engines open, read it back and draw it.

python examples/06_export_a_figure.py carla.glb carla.png
"""

import sys
from pathlib import Path

import vistel.figure
import vistel.render
from vistel.figure.formats.gltf import save_gltf


def main(file: str, picture: str) -> None:
    """Carla travels through a file and waves."""
    save_gltf(vistel.figure.builtin("carla").avatar, Path(file))
    carla = vistel.figure.load(file).pose(right_upper_arm=(0, 0, 60), right_lower_arm=70)
    vistel.render.picture(carla, size=(480, 640)).save(picture)
    print(f"{file}: {len(carla.avatar.mesh.vertices)} vertices; {picture}")


if __name__ == "__main__":
    main(*sys.argv[1:])

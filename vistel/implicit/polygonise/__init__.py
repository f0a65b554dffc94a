"""From shapes to meshes and back (Singh §3.3.4).

    from vistel.implicit.polygonise import polygonise, save

    mesh = polygonise(shape, resolution=128)
    save(mesh, Path("shape.obj"))

See docs/how-to/polygonise.md.
"""

from vistel.implicit.polygonise.back import pointblob_of, pointset_of, seeing_point
from vistel.implicit.polygonise.formats import FORMATS, save
from vistel.implicit.polygonise.incremental import Polygonisation
from vistel.implicit.polygonise.lattice import Lattice
from vistel.implicit.polygonise.mesh import SurfaceMesh
from vistel.implicit.polygonise.surface import polygonise

__all__ = [
    "FORMATS",
    "Lattice",
    "Polygonisation",
    "SurfaceMesh",
    "pointblob_of",
    "pointset_of",
    "polygonise",
    "save",
    "seeing_point",
]

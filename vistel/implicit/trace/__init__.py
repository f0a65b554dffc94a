"""Ray tracing of implicit surfaces and polygons (Singh §3.3.2 to §3.4).

    from vistel.implicit.scene import load, write_png
    from vistel.implicit.trace import RayCaster, render

    write_png("out.png", render(load("scene.toml"), antialias=0.1).light)
    RayCaster(program).first(origins, directions)        # distances (n,), infinite where nothing is met
    RayCaster(program).all(origins, directions)          # (n, k), every crossing of F = T

See docs/how-to/trace-a-scene.md.
"""

from vistel.implicit.trace.caster import METHODS, RayCaster
from vistel.implicit.trace.light import Seen, Tracer
from vistel.implicit.trace.mesh_tree import MeshTree
from vistel.implicit.trace.render import TracedPicture, render

__all__ = ["METHODS", "MeshTree", "RayCaster", "Seen", "TracedPicture", "Tracer", "render"]

"""`vistel polygonise`: writes the surface of a scene's shapes as a mesh file."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import SCENE
from vistel_cli.overwriting import Force, out_file
from vistel_cli.stop_asked import STOPPED, stopped_at_once
from vistel_cli.terminal import FAILED, USAGE, fail, out, print_error
from vistel_cli.waiting import progress


def polygonise(
    scene: Annotated[Path, Takes(SCENE), typer.Argument(help="Scene file (TOML), see docs/reference/scene-file.md.")],
    output: Annotated[Path, out_file("Mesh to write: .obj, .ply, .glb or .usda.")],
    resolution: Annotated[
        int | None, typer.Option("--resolution", min=2, help="Cells along the longest side of the shape; 128.")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option("--tolerance", min=0.0, help="Largest distance from mesh to surface \\[m]; sets the cell size.")
    ] = None,
    keep_polygons: Annotated[
        bool, typer.Option("--keep-polygons", help="Keep the polygons of polyhedral primitives that blend with no other.")
    ] = False,
    residual: Annotated[float, typer.Option("--residual", min=1e-6, help="Largest |F - T| at a vertex.")] = 1e-4,
    as_json: Annotated[bool, typer.Option("--json", help="Report as one JSON object.")] = False,
    stats: Annotated[bool, typer.Option("--stats", help="Also area, volume, whether it is closed, and times.")] = False,
    force: Force = False,
) -> None:
    """Turn the shapes of a scene into one closed mesh with normals, colours and texture coordinates.

    [bold]Examples[/bold]

      vistel polygonise examples/scenes/blobs.toml -o blobs.obj

      vistel polygonise examples/scenes/blobs.toml -o blobs.glb --tolerance 0.001 --stats
    """
    # Loaded here, so that other commands need not wait for it.
    from vistel.implicit.checks import ShapeError
    from vistel.implicit.polygonise import save
    from vistel.implicit.polygonise.formats import writable
    from vistel.implicit.scene import SceneError, load

    if resolution is not None and tolerance is not None:
        fail("polygonise: --resolution and --tolerance both say how fine the mesh is; give one of them", USAGE)
    if keep_polygons and tolerance is not None:
        fail("polygonise: --keep-polygons works on even cells; give --resolution instead of --tolerance", USAGE)
    fault = writable(output)
    if fault is not None:
        fail(f"polygonise: {fault}")
    try:
        read = load(scene)
    except SceneError as error:
        for line in str(error).splitlines():
            print_error(line)
        raise typer.Exit(FAILED) from error
    if read.shape is None:
        fail(f"{scene}: shapes: is empty, expected at least one shape to polygonise")
    begin = time.perf_counter()
    try:
        with stopped_at_once(STOPPED), progress(f"polygonising {scene.name}", show=not as_json) as tell:
            mesh = _made(read, resolution, tolerance, keep_polygons, residual, tell)
        took = time.perf_counter() - begin
        save(mesh, output)
    except (ShapeError, OSError) as error:
        fail(f"{scene}: {error}", FAILED)
    except MemoryError:
        fail(f"{scene}: polygonise: the memory ran out; use a larger tolerance or a lower resolution", FAILED)
    report: dict[str, Any] = {
        "output": str(output),
        "vertices": len(mesh.vertices),
        "triangles": len(mesh.triangles),
        "retained_polygons": mesh.retained,
        "residual": mesh.residual,
    }
    if stats:
        report |= {
            "area_m2": mesh.area,
            "volume_m3": mesh.volume,
            "euler": mesh.euler,
            "watertight": mesh.watertight,
            "manifold": mesh.manifold,
            "seconds": took,
        }
    if as_json:
        print(json.dumps(report))
        return
    for name, value in report.items():
        shown = f"{value:.6g}" if isinstance(value, float) else str(value)
        out.print(f"{name.replace('_', ' '):18} {shown}")


def _made(
    read: Any, resolution: int | None, tolerance: float | None, keep_polygons: bool, residual: float, tell: Callable[[float], None]
) -> Any:
    from vistel.implicit.polygonise import polygonise as make

    return make(
        read.program,
        resolution=resolution or 128,
        tolerance=tolerance,
        keep_polygons=keep_polygons,
        threshold=read.threshold,
        residual=residual,
        progress=tell,
    )

"""`vistel trace`: ray traces a scene file into a picture."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.text import Text

from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import SCENE
from vistel_cli.overwriting import Force, out_file
from vistel_cli.stop_asked import STOPPED, stopped_at_once
from vistel_cli.terminal import FAILED, USAGE, err, fail, out, print_error
from vistel_cli.waiting import progress

if TYPE_CHECKING:
    from vistel.implicit.scene import Scene


def trace(
    scene: Annotated[Path, Takes(SCENE), typer.Argument(help="The scene file (TOML).")],
    output: Annotated[Path, out_file("The PNG to write.")] = Path("out.png"),
    size: Annotated[str | None, typer.Option(help="WIDTHxHEIGHT in pixels instead of the scene's.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Tiles at once; by default one for each core.")] = None,
    depth: Annotated[int, typer.Option(min=0, max=16, help="Most reflections of a ray.")] = 3,
    antialias: Annotated[
        float, typer.Option(min=0, max=1, help="More rays where neighbours differ by more than this; 0: none.")
    ] = 0.1,
    shadows: Annotated[bool, typer.Option(help="Whether lamps cast shadows.")] = True,
    method: Annotated[str, typer.Option(help="How surfaces are found: auto, march, analytic, numeric.")] = "auto",
    samples: Annotated[
        int, typer.Option(min=1, max=1000, help="Guess points across the smallest primitive: more is safer, fewer faster.")
    ] = 8,
    stats: Annotated[bool, typer.Option("--stats", help="Report primitives, polygons and how many are candidates.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Report as one JSON object.")] = False,
    force: Force = False,
) -> None:
    """Ray trace a scene of implicit surfaces and polygons.

    [bold]Examples[/bold]

      vistel trace examples/scenes/blobs.toml -o blobs.png

      vistel trace examples/scenes/blobs.toml -o big.png --size 1600x1000 --antialias 0.05
    """
    from vistel.implicit.scene import write_png  # - brings Numba, which --help does not need
    from vistel.implicit.trace import render
    from vistel.implicit.trace.report import report

    pixels = picture_size(size)
    with scene_errors_printed():
        read = opened(scene, output)
        facts: dict[str, Any] = report(read) if stats or as_json else {}
        began, cpu = time.perf_counter(), time.process_time()
        with stopped_at_once(STOPPED), progress(f"tracing {scene.name}") as tell:
            picture = render(
                read,
                size=pixels,
                depth=depth,
                shadows=shadows,
                antialias=antialias,
                method=method,
                samples=samples,
                threads=threads,
                progress=tell,
            )
        seconds, cpu = time.perf_counter() - began, time.process_time() - cpu
        write_png(output, picture.light)
    facts = {
        "output": str(output),
        "width": picture.light.shape[1],
        "height": picture.light.shape[0],
        "implicit_pixels": int(np.count_nonzero(picture.thing == 1)),
        "polygon_pixels": int(np.count_nonzero(picture.thing == 2)),
        "refined_pixels": picture.refined,
        "seconds": round(seconds, 3),
        "cpu_seconds": round(cpu, 3),
    } | facts
    if as_json:
        print(json.dumps(facts))
        return
    out.print(f"{output}: {facts['width']} x {facts['height']} in {seconds:.1f} s", soft_wrap=True)
    if stats:
        for key, value in facts.items():
            if key != "output":
                out.print(f"  {key.replace('_', ' '):22}{value:>12}")


@contextmanager
def scene_errors_printed() -> Iterator[None]:
    """Turns the errors of a scene or its shapes into one line each, and ends the command."""
    from vistel.implicit.checks import ShapeError
    from vistel.implicit.scene import SceneError

    try:
        yield
    except (SceneError, ShapeError) as e:
        for line in str(e).splitlines():
            print_error(line)
        raise typer.Exit(FAILED) from e


def opened(scene: Path, output: Path) -> Scene:
    """The scene of a file. Prints its warnings. Ends the command when `output` cannot be written."""
    from vistel.implicit.scene import check_writable, load
    from vistel.implicit.trace.report import warnings

    check_writable(output)
    read = load(scene)
    for line in warnings(read):
        err.print(Text.assemble(("warning:", "yellow"), f" {scene}: {line}"), soft_wrap=True)
    return read


def picture_size(text: str | None) -> tuple[int, int] | None:
    """Pixels of an option such as 800x600. Ends the command for any other text."""
    if text is None:
        return None
    try:
        width, height = (int(n) for n in text.lower().split("x"))
    except ValueError:
        fail(f"--size: is {text!r}, expected WIDTHxHEIGHT such as 800x600", USAGE)
    if not (1 <= width <= 16384 and 1 <= height <= 16384):
        fail(f"--size: is {text}, expected 1 to 16384 pixels each way", USAGE)
    return width, height

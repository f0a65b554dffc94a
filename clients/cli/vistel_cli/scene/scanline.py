"""`vistel scanline`: draws a scene file row by row, in milliseconds."""

import json
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import SCENE
from vistel_cli.overwriting import Force, out_file
from vistel_cli.scene.trace import opened, picture_size, scene_errors_printed
from vistel_cli.stop_asked import STOPPED, stopped_at_once
from vistel_cli.terminal import out
from vistel_cli.waiting import waiting


def scanline(
    scene: Annotated[Path, Takes(SCENE), typer.Argument(help="The scene file (TOML).")],
    output: Annotated[Path, out_file("The PNG to write.")] = Path("out.png"),
    size: Annotated[str | None, typer.Option(help="WIDTHxHEIGHT in pixels instead of the scene's.")] = None,
    supersample: Annotated[int, typer.Option(min=1, max=8, help="Draw at so many times the size and average.")] = 1,
    as_json: Annotated[bool, typer.Option("--json", help="Report as one JSON object.")] = False,
    force: Force = False,
) -> None:
    """Draw a scene by scanlines: first hits, textures and highlights, but no shadows and no mirrors.

    [bold]Examples[/bold]

      vistel scanline examples/scenes/blobs.toml -o blobs.png

      vistel scanline examples/scenes/blobs.toml -o big.png --size 1600x1000 --supersample 2
    """
    from vistel.implicit.scanline import render  # - brings Numba, which --help does not need
    from vistel.implicit.scene import SceneError, write_png
    from vistel.implicit.trace.report import report

    pixels = picture_size(size)
    with scene_errors_printed():
        read = opened(scene, output)
        width, height = pixels or read.size
        if max(width, height) * supersample > 16384:
            raise SceneError(
                f"--supersample: {supersample} x {width}x{height} is more than 16384 pixels, expected a smaller picture"
            )
        began = time.perf_counter()
        with stopped_at_once(STOPPED), waiting(f"drawing {scene.name}"):
            picture = render(read, (width * supersample, height * supersample))
        seconds = time.perf_counter() - began
        light = np.clip(picture.light, 0, 1).reshape(height, supersample, width, supersample, 3).mean(axis=(1, 3))
        write_png(output, light)
    facts = {
        "output": str(output),
        "width": width,
        "height": height,
        "implicit_pixels": int(np.count_nonzero(picture.thing == 1)),
        "polygon_pixels": int(np.count_nonzero(picture.thing == 2)),
        "seconds": round(seconds, 3),
    } | report(read)
    if as_json:
        print(json.dumps(facts))
    else:
        out.print(f"{output}: {width} x {height} in {seconds:.2f} s", soft_wrap=True)

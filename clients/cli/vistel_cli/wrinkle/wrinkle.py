"""`vistel wrinkle`: shapes of wrinkles, and cloth and skin that wears them."""

from __future__ import annotations

import json
import math
import re
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from vistel_cli.avatar.files import Json, busy, report
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import PICTURE, SHAPE, SHEET
from vistel_cli.lazy import Lazy, lazy_group
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import FAILED, USAGE, fail, out
from vistel_cli.waiting import progress

if TYPE_CHECKING:
    from vistel.wrinkle.shape import WrinkleShape

LATER = {"studio": Lazy("vistel_cli.studio.open_studio:wrinkle_studio"), "wear": Lazy("vistel_cli.wrinkle.wear:wear")}
app = typer.Typer(cls=lazy_group(LATER), no_args_is_help=True)


@app.command("show")
def show(
    shapes: Annotated[
        list[str] | None, Takes(SHAPE, names=True), typer.Argument(help="Names of built-in shapes, or files (.toml); default: all.")
    ] = None,
    output: Annotated[Path | None, out_file("PNG: each shape's curves beside the resulting wrinkles.")] = None,
    wrinkledness: Annotated[float, typer.Option(min=0.0, max=1.0, help="Random deviation from the shape.")] = 0.0,
    seed: Annotated[int, typer.Option(help="Seed of the random deviation.")] = 0,
    size: Annotated[int, typer.Option(min=32, max=2048, help="Pixels across a shape.")] = 300,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """List the characteristic shapes, or draw them. Checks files.

    [bold]Examples[/bold]

      vistel wrinkle show

      vistel wrinkle show sleeve_bend my_shape.toml -o shapes.png
    """
    from vistel.wrinkle.errors import WrinkleError  # - the mathematics take long to load
    from vistel.wrinkle.picture import drawing, relief, sheet_of
    from vistel.wrinkle.shape_file import builtin_shapes, shape_of

    try:
        found = [shape_of(name) for name in shapes] if shapes else list(builtin_shapes().values())
    except WrinkleError as fault:
        fail(str(fault))
    if output is not None:
        pictures = []
        with progress("drawing", show=not as_json) as tell:
            for s in found:
                pictures.append(np.hstack((drawing(s, size), relief(s, size, wrinkledness=wrinkledness, seed=seed))))
                tell(len(pictures) / len(found))
        _write(output, sheet_of(pictures, 3 if len(pictures) > 4 else 1))
    if as_json:
        print(json.dumps({"shapes": [_facts(s) for s in found], "output": str(output) if output else None}))
        return
    for s in found:
        out.print(f"{s.name:22} {s.material:6} {len(s.branches)} curves  {s.about}", soft_wrap=True)
    if output is not None:
        out.print(f"  {output}", soft_wrap=True)


@app.command("draw")
def draw(
    sheet: Annotated[Path, Takes(SHEET), typer.Argument(help="A sheet of wrinkles (.toml).")],
    output: Annotated[Path | None, out_file("PNG: the wrinkled texture.")] = None,
    heights: Annotated[Path | None, out_file("PNG, 16 bit: the displacement map; 32768 is flat.", "--heights")] = None,
    bumps: Annotated[Path | None, out_file("PNG: its normals, for a bump map.", "--bumps")] = None,
    size: Annotated[int, typer.Option(min=16, max=8192, help="Texels along the longer side, without a texture.")] = 1024,
    limit: Annotated[float, typer.Option(min=0.0, help="How far the texture may move \\[mm].")] = 3.0,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Wrinkle a flat texture: displacement map, light, and the loss of correspondence.

    [bold]Examples[/bold]

      vistel wrinkle draw examples/wrinkles/sleeve.toml -o wrinkled.png --heights map.png
    """
    from vistel.wrinkle.displacement import blank, bump_normals, laid
    from vistel.wrinkle.errors import WrinkleError
    from vistel.wrinkle.picture import CLOTH, height_picture
    from vistel.wrinkle.sheet import load_sheet
    from vistel.wrinkle.texture import wrinkled_texture

    if output is None and heights is None and bumps is None:
        fail("nothing to write: give --out, --heights or --bumps", USAGE)
    try:
        plan, wrinkles = load_sheet(sheet)
        flat = None if plan.texture is None else read_picture(plan.texture)
        texels = size if flat is None else max(flat.shape[:2])
        of = blank(plan.size, texels, wraps=plan.wraps)
        if flat is None:
            flat = np.full((*of.height.shape, 3), CLOTH, np.uint8)
        with progress("laying wrinkles", show=not as_json) as tell:
            for n, _ in enumerate(laid(of, wrinkles), 1):
                tell(n / len(wrinkles))
        facts: dict[str, Any] = {"wrinkles": len(wrinkles), "width": of.height.shape[1], "height": of.height.shape[0]}
        facts |= {"highest_mm": round(1e3 * float(of.height.max()), 3), "deepest_mm": round(1e3 * float(of.height.min()), 3)}
        with ExitStack() as stack:
            stack.enter_context(busy("lighting and drawing", not as_json))
            if output is not None:
                picture, loss = wrinkled_texture(flat, of, limit=1e-3 * limit)
                _write(output, picture)
                facts |= {"moved_mm": round(1e3 * loss.shift, 3), "moved_mean_mm": round(1e3 * loss.mean, 3)}
                facts |= {"moved_to_keep_lengths_mm": round(1e3 * loss.wanted, 3), "limited": loss.limited}
            if heights is not None:
                _write(heights, height_picture(of))
            if bumps is not None:
                _write(bumps, np.asarray(np.round(127.5 * (bump_normals(of) + 1.0)), np.uint8))
    except WrinkleError as fault:
        fail(str(fault))
    report(as_json, {"sheet": str(sheet), **facts})


@app.command("trace")
def trace(
    photograph: Annotated[Path, Takes(PICTURE), typer.Argument(help="A picture of wrinkled cloth or skin, lit from one side.")],
    output: Annotated[Path, out_file("The shape file to write, .toml.")],
    lamp: Annotated[str, typer.Option(help="Direction of the lamp: degrees counter-clockwise from the right, or unknown.")] = "90",
    blur: Annotated[float, typer.Option(min=0.5, max=50.0, help="Pixels; about a third of a wrinkle's radius.")] = 3.0,
    strong: Annotated[float, typer.Option(min=0.01, max=1.0, help="Least strength, as a share of the strongest wrinkle's.")] = 0.35,
    shortest: Annotated[float, typer.Option(min=2.0, help="Ends shorter than this are removed \\[pixels].")] = 16.0,
    skin: Annotated[bool, typer.Option("--skin", help="Skin, not cloth.")] = False,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Make a wrinkle shape from a photograph: edges become curves, and their strengths the weights.

    [bold]Examples[/bold]

      vistel wrinkle trace sleeve.jpg -o my_sleeve.toml --lamp 120 --blur 4

      vistel wrinkle show my_sleeve.toml -o my_sleeve.png
    """
    from vistel.wrinkle.errors import WrinkleError
    from vistel.wrinkle.photograph import Looking
    from vistel.wrinkle.photograph import trace as traced
    from vistel.wrinkle.shape_file import save_shape

    if output.suffix != ".toml":
        fail(f"{output}: expected a name that ends in .toml")
    try:
        towards = None if lamp == "unknown" else math.radians(float(lamp))
    except ValueError:
        fail(f"--lamp: is {lamp!r}, expected degrees or unknown", USAGE)
    picture = read_picture(photograph)
    name = re.sub(r"[^a-z0-9]+", "_", output.stem.lower()).strip("_")
    name = name if name[:1].isalpha() else f"shape_{name}".rstrip("_")
    how = Looking(light=towards, blur=blur, strong=strong, weak=strong / 3.0, shortest=shortest)
    try:
        with busy("looking for wrinkles", not as_json):
            found = traced(picture, name, how, material="skin" if skin else "cloth")
        save_shape(found.shape, output)
    except WrinkleError as fault:
        fail(f"{photograph}: {fault}", FAILED)
    except OSError as fault:
        fail(f"{output}: cannot be written: {fault.strerror or fault}", FAILED)
    facts = {"output": str(output), "name": name, "curves": len(found.shape.branches)}
    facts |= {"unit_px": round(found.unit, 1), "thickness_px": round(found.thickness, 1)}
    report(as_json, facts | {"middle_px": [round(x, 1) for x in found.middle]})


def read_picture(path: Path) -> Any:
    """(H, W, 3) pixels of a picture file. Ends the command with one line when there are none."""
    from vistel.figure.making.pictures import decode
    from vistel.figure.making.source import MakingError

    try:
        return decode(path.read_bytes(), 8192)
    except OSError as fault:
        fail(f"{path}: cannot be read: {fault.strerror or fault}")
    except MakingError as fault:
        fail(f"{path}: {fault}")


def _write(path: Path, picture: Any) -> None:
    from PIL import Image

    try:
        Image.fromarray(picture).save(path)
    except (OSError, ValueError) as fault:
        fail(f"{path}: cannot be written: {fault}", FAILED)


def _facts(shape: WrinkleShape) -> dict[str, Any]:
    return {
        "name": shape.name,
        "material": shape.material,
        "about": shape.about,
        "branches": len(shape.branches),
        "control_points": sum(len(b.points) for b in shape.branches),
    }

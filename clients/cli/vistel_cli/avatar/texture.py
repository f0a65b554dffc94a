"""`vistel avatar islands` and `register`: registration of the texture on each part of an avatar's surface."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from vistel_cli.avatar.files import Json, check_output, load, report, save
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import GLTF, USD
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import FAILED, USAGE, fail, out


def islands(
    file: Annotated[Path, Takes(USD, GLTF), typer.Argument(help="An avatar file.")],
    sheet: Annotated[Path | None, out_file("PNG to write: the texture with the islands over it, numbered.", "--sheet")] = None,
    most: Annotated[int, typer.Option(min=1, help="How many to list, largest first.")] = 20,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """List the islands of an avatar's texture: parts of the surface that are registered one by one.

    [bold]Examples[/bold]

      vistel avatar islands me.usda --sheet islands.png
    """
    from vistel.figure.avatar import texture as avatar_texture
    from vistel.figure.making.uv_sheet import uv_sheet

    avatar = load(file)
    found = avatar_texture.islands(avatar)
    kept = {r.island: r for r in avatar.registration}
    if sheet is not None:
        try:
            uv_sheet(avatar).save(sheet)
        except (OSError, ValueError) as fault:
            fail(f"{sheet}: cannot be written: {fault}", FAILED)
    if as_json:
        rows = [asdict(i) | {"registration": asdict(kept[i.number]) if i.number in kept else None} for i in found]
        print(json.dumps({"file": str(file), "islands": rows}))
        return
    table = Table("island", "part", "area", "triangles", "u", "v", box=None)
    for column in table.columns:
        column.no_wrap = True
    for i in found[:most]:
        u, v, u_to, v_to = i.box
        place = (f"{u:.2f}–{u_to:.2f}", f"{v:.2f}–{v_to:.2f}")
        table.add_row(str(i.number), i.part, f"{1e4 * i.area:.0f} cm²", str(i.triangles), *place)
    out.print(table)
    if len(found) > most:
        out.print(f"and {len(found) - most} smaller ones (--most N)")
    for number, how in kept.items():
        moved = f"moved {how.move[0]:g},{how.move[1]:g}; turned {math.degrees(how.turn):g} degrees; scaled {how.scale:g}"
        out.print(f"island {number}: {moved}", soft_wrap=True)


def register(
    file: Annotated[Path, Takes(USD, GLTF), typer.Argument(help="An avatar file.")],
    island: Annotated[int, typer.Option(min=0, help="Its number, as `vistel avatar islands` lists them.")],
    output: Annotated[Path | None, out_file("Where to write; default: the file itself.")] = None,
    move: Annotated[str, typer.Option(help="U,V: right and up, in widths and heights of the whole texture.")] = "0,0",
    turn: Annotated[float, typer.Option(help="Counter-clockwise \\[degrees].")] = 0.0,
    scale: Annotated[float, typer.Option(min=0.001, max=1000.0, help="Factor of size; 2 doubles the picture on the island.")] = 1.0,
    texture: Annotated[
        Path | None, typer.Option(help="Another picture for this island; it covers the whole island at first.")
    ] = None,
    reset: Annotated[bool, typer.Option("--reset", help="Remove the registration of this island.")] = False,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Register the texture on one island: turn, scale and move it about the island's middle.

    The file keeps the registration. A new one replaces the old one of that island.

    [bold]Examples[/bold]

      vistel avatar register me.usda --island 10 --turn 12 --scale 1.1 --move 0.01,-0.004

      vistel avatar register me.usda --island 10 --texture face.png

      vistel avatar register me.usda --island 10 --reset
    """
    from vistel.figure.avatar.avatar import Registration
    from vistel.figure.avatar.texture import registered, unregistered, with_picture
    from vistel.figure.making.pictures import decode
    from vistel.figure.making.source import MakingError

    target = output or file
    check_output(target)
    try:
        u, v = (float(word) for word in move.split(","))
    except ValueError:
        fail(f"--move: expected U,V like 0.01,-0.02, got {move!r}", USAGE)
    avatar = load(file)
    try:
        if texture is not None:
            avatar = with_picture(avatar, island, decode(texture.read_bytes()))
        if reset:
            avatar = unregistered(avatar, island)
        elif texture is None or (u, v, turn, scale) != (0.0, 0.0, 0.0, 1.0):
            avatar = registered(avatar, Registration(island, (u, v), math.radians(turn), scale))
    except MakingError as fault:
        fail(f"{texture}: {fault}")
    except ValueError as fault:
        fail(f"{file}: {fault}")
    except OSError as fault:
        fail(f"{texture}: cannot be read: {fault.strerror or fault}")
    save(avatar, target, not as_json)
    picture = {} if texture is None else {"picture": f"{texture} on island {island}"}
    report(as_json, {"output": str(target), **picture, "registered": [r.island for r in avatar.registration]})

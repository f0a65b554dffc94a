"""`vistel world`: shows, changes and exports rooms and things."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from vistel_cli.avatar.files import busy
from vistel_cli.conference_choice import endpoint_of
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE, GLTF, LOG, OBJ, USD
from vistel_cli.lazy import Lazy, lazy_group
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import FAILED, USAGE, fail, load_conference, out, print_warning

if TYPE_CHECKING:
    from vistel.space.files import Interior
    from vistel.space.joints.joint import Joint
    from vistel.space.things.things import Thing

LATER = {
    "serve": Lazy("vistel_cli.world.serve:serve"),
    "where": Lazy("vistel_cli.world.move:where"),
    "move": Lazy("vistel_cli.world.move:move"),
    "spread": Lazy("vistel_cli.world.spread:spread"),
}
app = typer.Typer(cls=lazy_group(LATER), no_args_is_help=True)
Json = Annotated[bool, typer.Option("--json", help="Report as one JSON object.")]
ENDINGS = (".usda", ".usdc", ".usd", ".usdz", ".glb")


@app.command()
def show(
    file: Annotated[
        Path,
        Takes(USD, GLTF, OBJ, CONFERENCE),
        typer.Argument(help="A room or thing (USD, glTF, OBJ) or a conference file (TOML)."),
    ],
    picture: Annotated[Path | None, out_file("PNG to draw.", "--picture")] = None,
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT of the picture.")] = "960x540",
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Show a room's things with their materials, its seats, and notes from reading the file.

    [bold]Examples[/bold]

      vistel world show examples/rooms/den.usdz

      vistel world show examples/rooms/den.usdz --picture den.png
    """
    from vistel_cli.scene.trace import picture_size

    pixels = picture_size(size) or (960, 540)
    interior = opened(file, show=not as_json)
    if as_json:
        print(json.dumps(_facts(interior)))
    else:
        _table(interior)
    if picture is not None:
        _draw(interior, picture, pixels, show=not as_json)


@app.command()
def edit(
    file: Annotated[Path, Takes(USD, GLTF, OBJ), typer.Argument(help="The room to change.")],
    changes: Annotated[list[str], typer.Argument(help="What to change, such as: set baton mass=0.2 rigidity=0.8")],
    output: Annotated[Path | None, out_file("File for the changed room; default: its own file.")] = None,
    force: Force = False,
) -> None:
    """Change a room file. If one change fails, none is made.

    Changes are written as below; `then` stands between two of them.

    \b
      set THING|all KEY=VALUE ...
          KEY: mass, density, rigidity, elasticity, recovery, sticky, bears,
               colour, shape, name, id
      move THING \\[to=X,Y,Z] \\[by=X,Y,Z] \\[turn=DEGREES]
      add ID \\[shape=ball|lump|bar] \\[size=M] \\[at=X,Z] \\[mass=KG] \\[rigidity=R]
          \\[colour=#rrggbb] \\[elasticity=E] \\[name=TEXT]
      add ID file=PATH \\[at=X,Z] \\[turn=DEGREES] \\[fixed=yes|no] \\[mass=KG]
          \\[rigidity=R] \\[colour=#rrggbb] \\[name=TEXT]
      remove THING ...
      seat N|new at=X,Z \\[heading=DEGREES]
      seat N remove

    [bold]Examples[/bold]

      vistel world edit room.usda set baton mass=0.2 rigidity=0.8

      vistel world edit room.usda add mug file=mug.glb at=0.2,0.1 then remove cone -o other.usda
    """
    with busy("loading", True):
        from vistel.space.files.edit import edited
        from vistel.space.files.faults import RoomFileError

    target = output or file
    _check_output(target, glb=False)
    interior = replace(opened(file, show=True), notes=())
    try:
        with busy("changing", True):
            changed, told = edited(interior, changes)
    except RoomFileError as fault:
        fail(f"{fault}; `vistel world edit --help` shows how changes are written", USAGE)
    _save(replace(changed, notes=()), target)
    for line in (*told, *changed.notes):
        out.print(line, soft_wrap=True)


@app.command()
def export(
    source: Annotated[
        Path, Takes(USD, GLTF, OBJ, LOG, CONFERENCE), typer.Argument(help="A conference file, a log (MCAP), or a room file.")
    ],
    output: Annotated[Path, out_file("The USD or GLB to write.")],
    now: Annotated[bool, typer.Option("--now", help="For a conference that runs: as it is now; else as it begins.")] = False,
    hub: Annotated[str | None, typer.Option(help="Router of the conference that runs elsewhere, as it is now.")] = None,
    at: Annotated[float | None, typer.Option(help="For a log: seconds after its beginning; default: its end.")] = None,
    force: Force = False,
) -> None:
    """Write a room with its things: from a file, from a conference at its beginning or now, or from a log at a time.

    [bold]Examples[/bold]

      vistel world export conference.toml -o room.usda

      vistel world export conference.toml --now -o now.glb

      vistel world export out/latest/conference.mcap --at 12.5 -o then.usdz
    """
    with busy("loading", True):
        from vistel_cli.world.now import of_log, running

    _check_output(output, glb=True)
    if at is not None and source.suffix != ".mcap":
        fail("--at: only of a log; a running conference is written as it is", USAGE)
    if source.suffix == ".mcap":
        interior, when = of_log(source, at)
    elif now or hub is not None:
        if source.suffix != ".toml":
            fail(f"{source}: --now and --hub need a conference file (TOML)", USAGE)
        conference = load_conference(source)
        interior, when = running(conference, endpoint_of(conference, hub))
    else:
        interior, when = opened(source, show=True), "as it begins"
    _save(replace(interior, notes=()), output)
    out.print(f"{output}: {len(interior.room.things)} things, {when}", soft_wrap=True)


def opened(file: Path, show: bool) -> Interior:
    """The room of a file. Ends the command with one line when there is none."""
    with busy(f"reading {file.name}", show):
        from vistel.conference.rooms import interior_of
        from vistel.space.files import RoomFileError, load_room

        try:
            return interior_of(load_conference(file).room) if file.suffix == ".toml" else load_room(file)
        except RoomFileError as fault:
            fail(str(fault))


def _check_output(path: Path, *, glb: bool) -> None:
    endings = ENDINGS if glb else ENDINGS[:-1]
    if path.suffix.lower() not in endings:
        more = "" if glb else "; write it elsewhere with -o"
        fail(f"{path}: expected a name that ends in {', '.join(endings)}{more}")


def _save(interior: Interior, path: Path) -> None:
    from vistel.space.files import save_usd
    from vistel.space.files.gltf_write import save_glb

    try:
        with busy(f"writing {path.name}", True):
            (save_glb if path.suffix.lower() == ".glb" else save_usd)(interior, path)
    except OSError as fault:
        fail(f"{path}: cannot be written: {fault.strerror or str(fault)}", FAILED)


def _draw(interior: Interior, picture: Path, pixels: tuple[int, int], show: bool) -> None:
    from PIL import Image

    from vistel.render import NoOpenGlError
    from vistel.render.room_picture import room_picture

    try:
        with busy("drawing", show):
            image = room_picture(interior, *pixels)
        Image.fromarray(image).save(picture)
        if show:
            out.print(f"{picture}: {pixels[0]} x {pixels[1]}", soft_wrap=True)
    except NoOpenGlError as fault:
        fail(f"nothing to draw with: {fault}; `vistel doctor` says what is missing", FAILED)
    except (OSError, ValueError) as fault:
        why = getattr(fault, "strerror", None) or str(fault)
        fail(f"--picture {picture}: cannot be written ({why})", FAILED)


def _row(t: Thing, interior: Interior) -> dict[str, Any]:
    models = [interior.models[k.model] for k in t.looks if k.model in interior.models]
    pictures = sum(m.picture is not None for model in models for m in model.materials)
    return {
        "id": t.id,
        "name": t.name,
        "shape": t.shape,
        "fixed": t.fixed,
        "mass_kg": round(t.mass, 4),
        "rigidity": round(1.0 - t.compliance, 4),
        "elasticity": t.material.elasticity,
        "colour": f"#{t.colour >> 8:06x}",
        "position_m": [round(v, 4) for v in t.position.tolist()],
        "primitives": len(t.primitives),
        "triangles": sum(len(m.triangles) for m in models),
        "pictures": pictures,
    }


def _facts(interior: Interior) -> dict[str, Any]:
    from vistel.space.joints.json_values import from_joint

    return {
        "things": [_row(t, interior) for t in interior.room.things],
        "seats": [{"position_m": s.position.tolist(), "heading_rad": s.heading} for s in interior.room.seats],
        "joints": [from_joint(j) for j in interior.room.joints],
        "built_in_walls": interior.room.shell,
        "notes": list(interior.notes),
    }


def _table(interior: Interior) -> None:
    table = Table(box=None)
    table.add_column("thing", overflow="fold", ratio=1)
    for heading in ("mass", "rigidity", "x, y, z [m]", "felt as", "drawn as"):
        table.add_column(heading, justify="right", no_wrap=True)
    for t in interior.room.things:
        row = _row(t, interior)
        elasticity = "" if t.material.elasticity == "elastic" else f" {t.material.elasticity}"
        drawn = f"{row['triangles']} tri" + (f", {row['pictures']} pic" if row["pictures"] else "") if t.looks else row["colour"]
        table.add_row(
            t.id,
            "fixed" if t.fixed else f"{t.mass:.3g} kg",
            f"{row['rigidity']:g}{elasticity}",
            " ".join(f"{round(v, 2) + 0.0:.2f}" for v in t.position.tolist()),
            f"{len(t.primitives)} prim",
            str(drawn),
        )
    out.print(table)
    loose = [t for t in interior.room.things if not t.fixed]
    for joint in interior.room.joints:
        out.print(_hangs(joint), soft_wrap=True, highlight=False)
    things, seats = len(interior.room.things), len(interior.room.seats)
    out.print(f"{things} {_plural('thing', things)}, {len(loose)} loose; {seats} {_plural('seat', seats)}")
    for note in interior.notes:
        print_warning(note)


def _plural(word: str, count: int) -> str:
    return word if count == 1 else f"{word}s"


def _hangs(j: Joint) -> str:
    """What a joint does, in a line."""
    slides = j.kind.value == "slider"
    limits = [v * 1e3 if slides else math.degrees(v) for v in (j.lower, j.upper)]
    how = "slides on" if slides else "turns on"
    button = ", a button" if j.button else ""
    return f" {j.thing} {how} {j.base or 'the room'}: {limits[0]:g} to {limits[1]:g} {'mm' if slides else 'degrees'}{button}"

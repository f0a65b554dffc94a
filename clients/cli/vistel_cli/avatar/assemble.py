"""`vistel avatar assemble`: one avatar of separately scanned parts."""

import time
from pathlib import Path
from typing import Annotated

import typer

from vistel_cli.avatar.files import Json, busy, check_output, facts, report, save
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import PARTS
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import fail, out


def assemble(
    file: Annotated[Path, Takes(PARTS), typer.Argument(help="File that lists the parts and their positions (.toml).")],
    output: Annotated[Path, out_file("Avatar to write: .usda, .usdc, .usd or .usdz.")],
    name: Annotated[str, typer.Option(help="Name of the person; default from the file.")] = "",
    primitives: Annotated[int, typer.Option(help="Cone-spheres in the body: 23 (hands whole), 55, or up to 200.")] = 55,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Make an avatar of separately scanned parts: joined smoothly, closed, with one texture, its primitives fitted.

    [bold]Examples[/bold]

      vistel avatar assemble parts.toml -o me.usda
    """
    from vistel.figure.making.assembly import assemble as making
    from vistel.figure.making.make import make_avatar
    from vistel.figure.making.source import MakingError

    check_output(output)
    began = time.perf_counter()
    try:
        doing = f"reading {file.name}"

        def begin(step: str) -> None:
            nonlocal doing
            doing = step

        with busy(lambda: doing, not as_json):
            whole = making.assemble(file, step=begin)
            blended = time.perf_counter()
            made = make_avatar(
                whole.source,
                name=name or whole.name,
                height=whole.height,
                primitives=primitives,
                step=lambda step: begin(f"fitting: {step}"),
            )
    except MakingError as fault:
        fail(str(fault) if str(fault).startswith(str(file)) else f"{file}: {fault}")
    except OSError as fault:
        fail(f"{fault.filename or file}: cannot be read: {fault.strerror or fault}")
    save(made.avatar, output, not as_json)
    joints = [
        {
            "between": list(j.between),
            "radius_m": round(j.radius, 4),
            "zone_m": round(j.zone, 4),
            "gap_m": round(j.gap, 4),
            "triangles": j.triangles,
        }
        for j in whole.joints
    ]
    made_of = {
        "output": str(output),
        **facts(made.avatar),
        "joints_blended": len(joints),
        "open_edges": made.sound.border,
        "mean_distance_mm": round(1e3 * made.fit.mean_distance, 2),
        "assemble_seconds": round(blended - began, 2),
        "seconds": round(time.perf_counter() - began, 2),
    }
    if as_json:
        made_of |= {"joints": joints, "notes": list(made.notes)}
    else:
        for j in joints:
            gap = f"{1e3 * abs(j['gap_m']):.0f} mm {'gap' if j['gap_m'] >= 0 else 'overlap'}"
            out.print(f"  {' and '.join(j['between'])}: {gap}, blended over {2e3 * j['zone_m']:.0f} mm", soft_wrap=True)
        for note in made.notes:
            out.print(f"  {note}", soft_wrap=True)
    report(as_json, made_of)

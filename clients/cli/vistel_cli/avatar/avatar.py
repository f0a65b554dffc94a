"""`vistel avatar`: generates, imports, inspects and exports avatars."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vistel_cli.avatar.files import Json, busy, check_output, facts, load, load_or_make, own, report, save
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import GLTF, OBJ, USD
from vistel_cli.lazy import Lazy, lazy_group
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import FAILED, USAGE, fail, out

if TYPE_CHECKING:
    from vistel.figure.avatar.avatar import Avatar

LATER = {
    "assemble": Lazy("vistel_cli.avatar.assemble:assemble"),
    "layers": Lazy("vistel_cli.avatar.layers:layers"),
    "islands": Lazy("vistel_cli.avatar.texture:islands"),
    "register": Lazy("vistel_cli.avatar.texture:register"),
}
app = typer.Typer(cls=lazy_group(LATER), no_args_is_help=True)

Output = Annotated[Path, out_file("Avatar to write: .usda, .usdc, .usd or .usdz.")]
Primitives = Annotated[
    int, typer.Option("--primitives", help="Cone-spheres in the body: 23 (hands whole), 55 (fingers apart), or up to 200.")
]


@app.command("generate")
def generate(
    output: Output,
    name: Annotated[str, typer.Option(help="Name of the person; it also chooses every property that --look omits.")] = "",
    height: Annotated[float, typer.Option(min=0.5, max=2.6, help="Standing height \\[m].")] = 1.75,
    look: Annotated[
        str,
        typer.Option(
            help="word=value,...: person, seed, sex, age, weight, muscle, face, skin, hair, beard, glasses, top, pattern, "
            "bottom, shoes."
        ),
    ] = "",
    glasses: Annotated[
        str, typer.Option(help="Glasses: none, round, rectangular or half_rim; the same as glasses=KIND in --look.")
    ] = "",
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Write a built-in person as an avatar file.

    What --look leaves out is chosen by the name. person is one of the ten built-in ones; age is in years, weight in kilograms;
    skin is 0 (lightest) to 1; face is the number of a face.

    [bold]Examples[/bold]

      vistel avatar generate -o eva.usda --height 1.68 --look sex=female,age=41,weight=62,hair=bob

      vistel avatar generate -o ben.usda --look person=ben --glasses round

      vistel avatar generate -o somebody.usdz
    """
    check_output(output)
    look = ",".join(filter(None, (look, f"glasses={glasses}" if glasses else "")))
    name = name or output.stem
    began = time.perf_counter()
    try:
        with busy("making the person", not as_json):
            from vistel.figure.avatar.avatar import scaled
            from vistel.figure.people.builtin import builtin_avatar  # what makes people takes long to load

            # The body model measures who stands at ease, some millimetres shorter than with straight limbs.
            avatar = scaled(builtin_avatar(f"builtin:{look}", name=name, height=height), height)
    except ValueError as fault:
        fail(str(fault), USAGE)
    save(avatar, output, not as_json)
    report(as_json, {"output": str(output), **facts(avatar), "seconds": round(time.perf_counter() - began, 2)})


@app.command("import")
def import_(
    file: Annotated[
        Path, Takes(OBJ, GLTF, USD), typer.Argument(help="The mesh: .obj, .glb, .gltf, .vrm, .usda, .usdc, .usd or .usdz.")
    ],
    output: Output,
    name: Annotated[str, typer.Option(help="Name of the person.")] = "",
    height: Annotated[
        float | None, typer.Option(min=0.5, max=2.6, help="Height of the person \\[m]; measured on the mesh by default.")
    ] = None,
    unit: Annotated[float | None, typer.Option(min=1e-6, max=1e3, help="Metres of one unit of the file.")] = None,
    up: Annotated[str | None, typer.Option(help="Upward axis, Y or Z; measured on the shape by default.")] = None,
    texture: Annotated[Path | None, typer.Option(help="Picture of the skin, for a file that names none.")] = None,
    clothes: Annotated[
        list[Path] | None, typer.Option(help="Clothing: another mesh in the same frame (.obj, MakeHuman .mhclo); repeatable.")
    ] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig of MakeHuman (MPFB's rig.*.json) for its base mesh.")] = None,
    weights: Annotated[Path | None, typer.Option(help="The rig's weights (weights.*.json, .gz).")] = None,
    target: Annotated[
        list[str] | None, typer.Option(help="MakeHuman morph target, FILE or FILE=SHARE; may be given more than once.")
    ] = None,
    expressions: Annotated[
        Path | None, typer.Option(help="Folder of MakeHuman targets for expressions, or one such target.")
    ] = None,
    primitives: Primitives = 55,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Make an avatar from a mesh of a person. Finds unit and axes, fits skeleton and primitives, and bends the mesh to the T-pose.

    Joints come from the file's rig. Without a rig they come from the shape, which must stand in T- or A-pose.

    [bold]Examples[/bold]

      vistel avatar import scan.obj -o me.usda

      vistel avatar import me.vrm -o me.usda

      vistel avatar import base.obj -o me.usda --rig rig.game_engine.json --weights weights.game_engine.json.gz --texture skin.png
    """
    from vistel.figure.making.files.read import Extras, read_source
    from vistel.figure.making.make import make_avatar
    from vistel.figure.making.source import MakingError

    check_output(output)
    if up is not None and up.upper() not in ("Y", "Z"):
        fail(f"--up: expected Y or Z, got {up!r}", USAGE)
    if weights is not None and rig is None:
        fail("--weights: belongs to a rig; give --rig too", USAGE)
    began = time.perf_counter()
    if (avatar := own(file)) is not None:
        avatar = avatar if not name else replace(avatar, name=name)
        save(avatar, output, not as_json)
        out.print("  the file is an avatar of VISTEL already; used unchanged", soft_wrap=True) if not as_json else None
        report(as_json, {"output": str(output), **facts(avatar), "seconds": round(time.perf_counter() - began, 2)})
        return
    try:
        with busy(f"reading {file.name}", not as_json):
            source = read_source(file, Extras(texture, tuple(clothes or ()), rig, weights, tuple(target or ()), expressions))
        fitting = time.perf_counter()
        doing = "preparing to fit"

        def begin(step: str) -> None:
            nonlocal doing
            doing = f"fitting: {step}"

        with busy(lambda: doing, not as_json):
            made = make_avatar(
                source,
                name=name or output.stem,
                unit=unit,
                up=up.upper() if up else None,
                height=height,
                primitives=primitives,
                step=begin,
            )
        fitted = time.perf_counter() - fitting
    except MakingError as fault:
        of_a_file = str(fault).startswith(str(file)) or "/" in str(fault).partition(": ")[0]
        fail(str(fault) if of_a_file else f"{file}: {fault}")
    except OSError as fault:
        fail(f"{fault.filename or file}: cannot be read: {fault.strerror or fault}")
    except ValueError as fault:
        fail(f"{file}: {fault}")
    save(made.avatar, output, not as_json)
    said = {
        "output": str(output),
        **facts(made.avatar),
        "joints_from": made.skeleton_from,
        "weights_from": made.weights_from,
        "arms_below_horizontal_deg": round(math.degrees(made.pose_angle), 1),
        **_fit_facts(made.fit),
        "fit_seconds": round(fitted, 2),
        "seconds": round(time.perf_counter() - began, 2),
    }
    if as_json:
        said |= {"joint_names": dict(made.joint_of), "unknown_joints": list(made.unknown), "notes": list(made.notes)}
    else:
        for note in made.notes:
            out.print(f"  {note}", soft_wrap=True)
        if made.unknown:
            out.print(f"  joints with unknown names follow their parent joint: {', '.join(made.unknown)}", soft_wrap=True)
    report(as_json, said)


@app.command("fit")
def fit(
    file: Annotated[Path, Takes(USD, GLTF), typer.Argument(help="An avatar file.")],
    output: Annotated[Path | None, out_file("Where to write; default: the file itself.")] = None,
    primitives: Primitives = 60,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Fit another set of primitives to an avatar's mesh. More primitives follow it more closely and cost more time.

    [bold]Examples[/bold]

      vistel avatar fit me.usda --primitives 60
    """
    from vistel.figure.making.make import refit

    avatar = load(file)
    target = output or file
    if target.suffix.lower() == ".npz":
        fail(f"{target}: is a cached person; write to another file with -o NAME.usda")
    check_output(target)
    began = time.perf_counter()
    try:
        with busy("fitting", not as_json):
            fitted, result = refit(avatar, primitives)
    except ValueError as fault:
        fail(f"--{fault}", USAGE)
    took = time.perf_counter() - began
    save(fitted, target, not as_json)
    report(as_json, {"output": str(target), **_fit_facts(result), "fit_seconds": round(took, 2)})


@app.command("inspect")
def inspect(
    file: Annotated[str, Takes(USD, GLTF, names=True), typer.Argument(help='An avatar file, or "builtin:person=carla".')],
    sheet: Annotated[Path | None, out_file("PNG to write: the face and a dozen postures.", "--sheet")] = None,
    verbose: Annotated[bool, typer.Option("--verbose", help="Also every figure, and the fit of each primitive.")] = False,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Tell whether an avatar is sound: its mesh, and how closely its primitives follow it. --sheet draws it in a dozen postures.

    [bold]Examples[/bold]

      vistel avatar inspect me.usda --sheet me.png
    """
    from vistel.figure.making.report import inspect_avatar, verdict

    avatar = load_or_make(file)
    with busy("inspecting the avatar", not as_json):
        said, fit = inspect_avatar(avatar)
    if sheet is not None:
        _draw(avatar, sheet, not as_json)
        said["sheet"] = str(sheet)
    if not as_json:
        for line in (*verdict(said), *(("", *fit.lines()) if verbose else ())):
            out.print(line, soft_wrap=True)
    if as_json or verbose:
        report(as_json, said)


@app.command("export")
def export(
    file: Annotated[str, Takes(USD, GLTF, names=True), typer.Argument(help='An avatar file, or "builtin:person=carla".')],
    output: Annotated[Path, out_file("File to write: .usda, .usdc, .usdz, .glb, .vrm or .obj.")],
    author: Annotated[str, typer.Option(help="Author named in a VRM file; default: the avatar's name.")] = "",
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Write an avatar in another format.

    USD keeps everything. glTF and VRM 1.0 have pictures as JPEG and omit the coarser levels of detail, which reading makes anew.
    OBJ keeps the shape and its texture.

    [bold]Examples[/bold]

      vistel avatar export me.usda -o me.usdz

      vistel avatar export me.usda -o me.vrm --author "Ben Okri"
    """
    from vistel.figure.formats.gltf import GLTF_ENDINGS, save_gltf
    from vistel.figure.formats.obj import export_obj
    from vistel.figure.making.source import USD_ENDINGS

    ending = output.suffix.lower()
    known = (*USD_ENDINGS, *GLTF_ENDINGS, ".obj")
    if ending not in known:
        fail(f"{output}: expected a name that ends in {', '.join(known)}")
    avatar = load_or_make(file, output.stem)
    if ending in USD_ENDINGS:
        save(avatar, output, not as_json)
    else:
        try:
            with busy(f"writing {output.name}", not as_json):
                save_gltf(avatar, output, author=author) if ending in GLTF_ENDINGS else export_obj(avatar, output)
        except OSError as fault:
            fail(f"{output}: cannot be written: {fault.strerror or fault}", FAILED)
    report(as_json, {"output": str(output), "bytes": output.stat().st_size, **facts(avatar)})


def _draw(avatar: Avatar, sheet: Path, show: bool) -> None:
    from vistel.figure.posture.standard import standard_postures
    from vistel.render import NoOpenGlError
    from vistel.render.figures.portrait import Portraits

    try:
        with busy("drawing", show):
            portraits = Portraits()
            try:
                portraits.sheet([avatar], standard_postures(), columns=7).save(sheet)
            finally:
                portraits.close()
    except NoOpenGlError as fault:
        fail(str(fault), FAILED)
    except (OSError, ValueError) as fault:
        fail(f"{sheet}: cannot be written: {fault}", FAILED)


def _fit_facts(result: Any) -> dict[str, Any]:
    return {"primitives": len(result.body), "mean_distance_mm": round(1e3 * result.mean_distance, 2)}

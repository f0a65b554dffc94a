"""`vistel log export`: a log, or something of it, for other programs."""

import importlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vistel.wire.log import LogError, LogReader
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import LOG
from vistel_cli.lazy import interruptible
from vistel_cli.log.study import A_LOG, Begin, End, opened
from vistel_cli.overwriting import Force, keep_source, out_file
from vistel_cli.terminal import USAGE, fail, out, print_warning
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from vistel.log import Log

BVH_FPS = 60.0
"""Frames per second of motion, as it is recorded."""
USD_FPS = 30.0
"""Samples per second of a whole conference."""
_WAYS = {f".{kind}": f"--{kind} NAME" for kind in ("csv", "npz", "parquet", "bvh", "c3d", "glb", "wav")}
_WAYS |= {".mcap": "--foxglove", ".rrd": "--rerun"}
"""The option that belongs to a file's ending; without one of these a USD file is written."""


def export(
    log: Annotated[Path, Takes(LOG), A_LOG],
    output: Annotated[Path, out_file("File to write; the parts of a USD file go into a folder beside it.")],
    begin: Begin = 0.0,
    end: End = None,
    fps: Annotated[
        float | None,
        typer.Option(min=1.0, max=240.0, help="Samples per second; default: 30, of --bvh and --c3d 60.", show_default=False),
    ] = None,
    numbers: Annotated[
        list[str] | None,
        typer.Option("--csv", metavar="NAME", help="A table of a number, named as in `vistel log grep`, or of a joint."),
    ] = None,
    bvh: Annotated[str | None, typer.Option(metavar="PARTICIPANT", help="The skeleton of this person, for animation.")] = None,
    c3d: Annotated[
        str | None, typer.Option(metavar="PARTICIPANT", help="The joints of this person, for laboratories; needs ezc3d.")
    ] = None,
    glb: Annotated[
        str | None, typer.Option(metavar="PARTICIPANT", help="The figure of this person, as glTF with an animation.")
    ] = None,
    wav: Annotated[str | None, typer.Option(metavar="PARTICIPANT", help="The voice of this person.")] = None,
    npz: Annotated[
        list[str] | None, typer.Option("--npz", metavar="NAME", help="Arrays of numbers named as with --csv, or of a participant.")
    ] = None,
    parquet: Annotated[
        list[str] | None, typer.Option("--parquet", metavar="NAME", help="As --csv, for programs that read Parquet; needs pyarrow.")
    ] = None,
    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="People, things and events as MCAP for Foxglove and Lichtblick.")
    ] = False,
    rerun: Annotated[bool, typer.Option("--rerun", help="The same as a recording of Rerun; needs rerun-sdk.")] = False,
    force: Force = False,
) -> None:
    """Write a log for other programs: by default people, room and cameras as USD with time samples, for usdview and Blender.

    [bold]Examples[/bold]

      vistel log export out/latest/conference.mcap -o meeting.usda --from 10 --to 20

      vistel log export out/latest/conference.mcap -o wrist.csv --csv participant.ben.motion.left_wrist

      vistel log export out/latest/conference.mcap -o ben.bvh --bvh ben

      vistel log export out/latest/conference.mcap -o ben.c3d --c3d ben

      vistel log export out/latest/conference.mcap -o ben.glb --glb ben

      vistel log export out/latest/conference.mcap -o viewed.mcap --foxglove
    """
    ways = {"--csv": numbers, "--npz": npz, "--parquet": parquet, "--bvh": bvh, "--c3d": c3d, "--glb": glb, "--wav": wav}
    asked = [name for name, value in (ways | {"--foxglove": foxglove, "--rerun": rerun}).items() if value]
    keep_source(log, output)
    if len(asked) > 1:
        fail(f"{asked[0]} and {asked[1]}: write different files; give one of them", USAGE)
    if not asked:
        if (way := _WAYS.get(output.suffix.lower())) is not None:
            fail(f"{output}: expected {way} as well, which says what to write", USAGE)
        _usd(log, output, begin, end, fps or USD_FPS)
        return
    found = opened(log)
    writers: dict[str, Callable[[], str]] = {
        "--csv": lambda: _csv(found, numbers or (), output, begin, end),
        "--npz": lambda: _npz(found, npz or (), output, begin, end),
        "--parquet": lambda: _parquet(found, parquet or (), output, begin, end),
        "--bvh": lambda: _bvh(found, bvh or "", output, begin, end, fps or BVH_FPS),
        "--c3d": lambda: _c3d(found, c3d or "", output, begin, end, fps or BVH_FPS),
        "--glb": lambda: _glb(found, glb or "", output, begin, end, fps or USD_FPS),
        "--wav": lambda: _wav(found, wav or "", output, begin, end),
        "--foxglove": lambda: _foxglove(found, output, begin, end, fps or USD_FPS),
        "--rerun": lambda: _rerun(found, output, begin, end, fps or USD_FPS),
    }
    _writing(found, output, writers[asked[0]])


def _usd(log: Path, output: Path, begin: float, end: float | None, fps: float) -> None:
    with waiting("loading"), interruptible():
        importlib.import_module("pxr.UsdSkel")  # loses Ctrl-C while it is loaded
        from vistel_cli.log.usd import export_usd  # the mathematics

    try:
        reader = LogReader(log)
    except LogError as e:
        fail(str(e))
    for line in reader.damage:
        print_warning(f"{log}: {line}")
    export_usd(reader, log, output, begin, end, fps)


def _writing(log: "Log", output: Path, write: Callable[[], str]) -> None:
    """Write, and tell what was written; what cannot be gets one line."""
    before = 0.0

    def doing() -> str:
        """How much is read, while that grows; what comes after reading may take longer."""
        nonlocal before
        reads, before = log.share_read > before, log.share_read
        return f"writing {output.name}" + (f": {before:.0%} of {log.path.name} read" if reads else "")

    try:
        with waiting(doing):
            written = write()
    except ValueError as e:
        fail(str(e), USAGE)
    except OSError as e:
        fail(f"--out {output}: cannot be written: {e.strerror}")
    out.print(written, soft_wrap=True)


def _csv(log: "Log", names: Sequence[str], output: Path, begin: float, end: float | None) -> str:
    from vistel.log.exports import write_csv
    from vistel.log.numbers import tracks, with_fields

    found = tracks(log, with_fields(names), begin, end)
    return f"{write_csv(found, output)} rows of {len(found)} numbers written to {output}"


def _c3d(log: "Log", participant: str, output: Path, begin: float, end: float | None, fps: float) -> str:
    from vistel.log.c3d import write_c3d

    return f"{write_c3d(log, participant, output, begin, end, fps)} frames of {participant} written to {output}"


def _glb(log: "Log", participant: str, output: Path, begin: float, end: float | None, fps: float) -> str:
    from vistel.log.glb import write_glb

    return f"{write_glb(log, participant, output, begin, end, fps)} frames at {fps:g}/s written to {output}"


def _npz(log: "Log", names: Sequence[str], output: Path, begin: float, end: float | None) -> str:
    from vistel.log.arrays import write_npz

    written = write_npz(log, names, output, begin, end)
    return f"{len(written)} arrays written to {output}: {', '.join(written)}"


def _parquet(log: "Log", names: Sequence[str], output: Path, begin: float, end: float | None) -> str:
    try:
        import pyarrow as arrow  # pyright: ignore[reportMissingImports]
        from pyarrow import parquet  # pyright: ignore[reportMissingImports]
    except ImportError as e:
        raise ValueError("--parquet: needs pyarrow: pip install pyarrow; or take --npz") from e
    from vistel.log.numbers import together, tracks, with_fields

    found = tracks(log, with_fields(names), begin, end)
    times, values = together(found.values())
    columns: dict[str, Any] = {"t": times} | dict(zip(found, values, strict=True))
    with output.open("wb") as file:
        parquet.write_table(arrow.table(columns), file)
    return f"{len(times)} rows of {len(found)} numbers written to {output}"


def _foxglove(log: "Log", output: Path, begin: float, end: float | None, fps: float) -> str:
    from vistel.log.foxglove import write_foxglove

    return f"{write_foxglove(log, output, begin, end, fps)} messages written to {output}"


def _rerun(log: "Log", output: Path, begin: float, end: float | None, fps: float) -> str:
    from vistel.log.rerun_recording import write_rerun

    return f"{write_rerun(log, output, begin, end, fps)} moving things and joints written to {output}"


def _bvh(log: "Log", participant: str, output: Path, begin: float, end: float | None, fps: float) -> str:
    import io

    from vistel.log.bvh import write_bvh

    text = io.StringIO()  # nothing is written where there is no posture
    count = write_bvh(log, participant, text, begin, end, fps)
    output.write_text(text.getvalue(), encoding="utf-8")
    return f"{count} frames of {participant} written to {output}"


def _wav(log: "Log", participant: str, output: Path, begin: float, end: float | None) -> str:
    from vistel.log.voices import write_wav

    length = write_wav(log, participant, output, begin, end)
    return f"{length:.1f} s of {participant}'s voice written to {output}"

"""`vistel calibrate distortion`: corrects the distortion of a magnetic tracker by metal in the room."""

import csv
import math
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from vistel.arrays import F64
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CSV, LOG
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import USAGE, fail, out

POSITION = ("x", "y", "z")
"""Columns of a position, after "true_" or "read_"."""
ROTATION = ("qx", "qy", "qz", "qw")
"""Columns of a quaternion, after "true_" or "read_"."""


def distortion(
    points: Annotated[
        Path, Takes(CSV), typer.Argument(help="CSV of known points: true_x ... and, without --log, read_x ..., metres.")
    ],
    log: Annotated[
        Path | None, Takes(LOG), typer.Option("--log", help="A log in which a receiver was held on each point in turn.")
    ] = None,
    device: Annotated[str, typer.Option(help="With --log: the tracker, aiko-tracker.")] = "",
    station: Annotated[int, typer.Option(help="With --log: which of its receivers was held.")] = 1,
    output: Annotated[Path, out_file("The grid.")] = Path("distortion.json"),
    step: Annotated[float, typer.Option(help="Metres between the grid's corners.")] = 0.1,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    force: Force = False,
) -> None:
    """Make a correction grid from points with known positions.

    The file has a line of headings and one line per point, transmitter frame: true_x, true_y, true_z and read_x, read_y,
    read_z in metres; where orientations are known too, true_qx ... true_qw and read_qx ... read_qw. With --log the
    readings come from a recording in which the receiver is held still on each point for two seconds or more, in the file's order.

    [bold]Examples[/bold]

      vistel calibrate distortion points.csv --out distortion.json

      vistel calibrate distortion points.csv --log out/latest/conference.mcap --device aiko-tracker --station 3
    """
    # Loads what only this command needs.
    from vistel.figure.calibration.distortion import DistortionError, fit_distortion, judge, pose_errors, save_distortion

    if not 0.01 <= step <= 1.0:
        fail(f"--step {step}: expected 0.01 to 1 m", USAGE)
    if log is None:
        true, read = read_points(points, "true"), read_points(points, "read")
    elif not device:
        fail("--device: name the tracker whose receiver was held on the points, aiko-tracker", USAGE)
    else:
        true = read_points(points, "true")
        read = recorded_points(log, device, station, len(true[0]))
        if not has_rotations(points):
            true = true[0], read[1]  # nothing is known about orientations, so nothing is learnt
    errors = pose_errors(true, read)
    try:
        report = judge(read[0], errors, step)
        save_distortion(fit_distortion(read[0], errors, step), output)
    except DistortionError as e:
        fail(f"{points}: {e}")
    except OSError as e:
        fail(f"{output}: cannot be written: {e.strerror}")
    better = report.after_m < 0.7 * report.before_m
    found: dict[str, Any] = {
        "points": report.points,
        "before_mm": round(1e3 * report.before_m, 2),
        "after_mm": round(1e3 * report.after_m, 2),
        "before_deg": round(math.degrees(report.before_rad), 3),
        "after_deg": round(math.degrees(report.after_rad), 3),
        "file": str(output),
        "verdict": "good" if better else "of no use",
    }
    if as_json:
        out.print_json(data=found)
        return
    out.print(
        f"{report.points} points. As read: {found['before_mm']} mm, {found['before_deg']}°; corrected, at points left out "
        f"of the fit: {found['after_mm']} mm, {found['after_deg']}° (root mean square). Written to {output}.",
        soft_wrap=True,
    )
    if not better:
        out.print("The grid hardly helps: measure more points, closer together, or there is no distortion to correct.")


def read_points(path: Path, which: str) -> tuple[F64, F64]:
    """Positions (n, 3) and quaternions (n, 4) of the columns `which`, "true" or "read". Ends the command with one line when
    they cannot be read."""
    rows = _rows(path)
    missing = [f"{which}_{a}" for a in POSITION if f"{which}_{a}" not in (rows[0] if rows else {})]
    if missing:
        fail(f"{path}: lacks the columns {', '.join(missing)}")
    names = POSITION + ROTATION if has_rotations(path) else POSITION
    table = np.zeros((len(rows), 7))
    table[:, 6] = 1.0
    for k, row in enumerate(rows):
        try:
            table[k, : len(names)] = [float(row[f"{which}_{a}"]) for a in names]
        except (TypeError, ValueError, KeyError):
            fail(f"{path}: line {k + 2}: expected numbers in every column")
    norm = np.linalg.norm(table[:, 3:], axis=1, keepdims=True)
    if not np.isfinite(table).all() or np.abs(norm - 1.0).max() > 0.1:
        fail(f"{path}: line {int(np.abs(norm - 1.0).argmax()) + 2}: expected finite numbers and unit quaternions")
    return table[:, :3], table[:, 3:] / norm


def has_rotations(path: Path) -> bool:
    """Whether a file of points holds true orientations."""
    rows = _rows(path)
    return bool(rows) and all(f"true_{a}" in rows[0] for a in ROTATION)


def _rows(path: Path) -> list[dict[str, str]]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as e:
        fail(f"{path}: cannot be read as CSV: {e}")


def recorded_points(log: Path, device: str, station: int, count: int) -> tuple[F64, F64]:
    """Poses at which a receiver was held still in a log, `count` times: positions (n, 3), quaternions (n, 4). Ends the command
    with one line when there are fewer or more."""
    from vistel.figure.calibration.moves import MoveError, find_rests
    from vistel_cli.calibrate.gather import recorded

    try:
        position, rotation = find_rests(*recorded(log, device, {station: "held"})["held"])
    except MoveError as e:
        fail(str(e))
    if len(position) != count:
        fail(
            f"{log}: station {station} of {device} was held still {len(position)} times, the file has {count} points; "
            "hold it for two seconds on each, and move it by 3 cm or more between them"
        )
    return position, rotation

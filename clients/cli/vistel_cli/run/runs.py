"""`vistel runs`: the folders of earlier runs."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from vistel.conference.running import running_conferences
from vistel_cli.run.folders import LATEST, RUNS, in_use, runs_in
from vistel_cli.terminal import fail, out

app = typer.Typer(invoke_without_command=True)
Where = Annotated[Path, typer.Option("--in", help="Folder with the folders of runs.")]


@app.callback()
def runs(
    ctx: typer.Context, where: Where = RUNS, as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False
) -> None:
    """List the folders of runs, and clear old ones.

    [bold]Examples[/bold]

      vistel runs

      vistel runs clear --keep 3
    """
    if ctx.invoked_subcommand is not None:
        return
    rows = [_row(folder) for folder in runs_in(where)]
    if as_json:
        print(json.dumps({"runs": rows}))
        return
    table = Table("folder", box=None)
    table.columns[0].overflow = "fold"
    for heading in ("size", "films", "log", ""):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        marks = ("yes" if row["log"] else "", "runs" if row["running"] else "")
        table.add_row(row["folder"], f"{row['bytes'] / 1e6:.1f} MB", str(row["films"] or ""), *marks)
    out.print(table if rows else f"no runs in {where}")


@app.command()
def clear(keep: Annotated[int, typer.Option(min=0, help="How many of the newest stay.")], where: Where = RUNS) -> None:
    """Remove the folders of all but the newest runs. Runs that go on stay, and so does everything else in the folder.

    [bold]Example[/bold]

      vistel runs clear --keep 3
    """
    freed, found = 0, runs_in(where)
    for row in [_row(folder) for folder in found[keep:]]:
        if row["running"]:
            continue
        try:
            shutil.rmtree(row["folder"])
        except OSError as e:
            fail(f"{row['folder']}: cannot be removed: {e.strerror}")
        out.print(f"removed {row['folder']}", soft_wrap=True)
        freed += row["bytes"]
    latest = where / LATEST
    if latest.is_symlink() and not latest.exists():
        latest.unlink()
    out.print(f"{freed / 1e6:.1f} MB freed" if found else f"no runs in {where}")


def _row(folder: Path) -> dict[str, Any]:
    files = list(folder.rglob("*"))
    return {
        "folder": str(folder),
        "bytes": sum(_size(f) for f in files),
        "films": sum(f.suffix == ".mp4" for f in files),
        "log": any(f.suffix == ".mcap" for f in files),
        "running": in_use(folder) or any(Path(r.folder).resolve() == folder.resolve() for r in running_conferences()),
    }


def _size(file: Path) -> int:
    """0 for a folder, and for what a run that goes on has just removed."""
    try:
        return file.stat().st_size if file.is_file() else 0
    except FileNotFoundError:
        return 0

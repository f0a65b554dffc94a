"""`vistel bench`: VISTEL's figures beside those of a named peer, from one run."""

import importlib
import inspect
import json
import shlex
import subprocess
import sys
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from vistel_cli.terminal import FAILED, USAGE, fail, out, print_error

_ROOT = Path(__file__).resolve().parents[3]


def bench(
    name: Annotated[str | None, typer.Argument(help="Name of the benchmark; without one, the list.")] = None,
    every: Annotated[bool, typer.Option("--all", help="Run all of them.")] = False,
    part: Annotated[list[str] | None, typer.Option("--part", help="Only this part, if the benchmark has some; repeatable.")] = None,
    thorough: Annotated[bool, typer.Option("--thorough", help="Run the long form, if the benchmark has one.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per figure.")] = False,
) -> None:
    """Measure VISTEL and a peer in turn, in one run. Shows medians, ratios and targets.

    [bold]Examples[/bold]

      vistel bench

      vistel bench wire --json

      vistel bench guest --part page
    """
    known = _known()
    if name is None and not every:
        for key, about in known.items():
            out.print(f"{key:12} {about}")
        return
    if name is not None and name not in known:
        fail(f"bench {name}: no such benchmark; there are {', '.join(known)}", USAGE)
    if part and every:
        fail("bench: --part is for one benchmark; leave out --all", USAGE)
    faults = [fault for key in (known if every else [str(name)]) if (fault := _run(key, part or [], thorough, as_json))]
    for fault in faults:
        print_error(f"bench {fault}")
    if faults:
        raise typer.Exit(FAILED)


def _run(name: str, parts: Sequence[str], thorough: bool, as_json: bool) -> str | None:
    """Runs one benchmark and prints its figures. parts: those that are wanted; none: all. Returns why it could not measure, if it
    could not."""
    rows: list[dict[str, Any]] = []
    why = None
    try:
        benchmark, row = _load(name), importlib.import_module("benchmarks.row")
        if parts:
            _check_parts(name, parts, getattr(benchmark, "PARTS", ()))
        asked, under = {"parts": parts, "thorough": thorough}, row.conditions()
        run = benchmark.run
        for figure in run(**{key: asked[key] for key in asked.keys() & inspect.signature(run).parameters.keys()}):
            rows.append(row.line(figure, under))
            if as_json:
                print(json.dumps(rows[-1]), flush=True)
    except FileNotFoundError as e:
        why = f"{name}: {e.filename}: not here, and needed"
    except ImportError as e:
        why = f"{name}: the package {e.name} is needed"
    except subprocess.CalledProcessError as e:
        said = (e.stderr or e.stdout or "").strip().splitlines()
        why = f"{name}: {shlex.join(e.cmd)} ended with {e.returncode}{': ' + said[-1] if said else ''}"
    except typer.Exit:  # which is a RuntimeError, too
        raise
    except RuntimeError as e:
        why = f"{name}: {e}"
    if rows and not as_json:
        _show(rows)
    return why if why or rows else f"{name}: nothing could be measured here; what it needs is missing"


def _check_parts(name: str, parts: Sequence[str], there: Collection[str]) -> None:
    if not there:
        fail(f"bench {name}: has no parts; leave out --part", USAGE)
    if unknown := [part for part in parts if part not in there]:
        fail(f"bench {name}: no such part: {', '.join(unknown)}; there are {', '.join(there)}", USAGE)


def _known() -> dict[str, str]:
    folder = _ROOT / "benchmarks"
    if not folder.is_dir():
        fail("bench: the benchmarks live in the repository; run from a checkout (pip install -e .)")
    if str(_ROOT) not in sys.path:
        sys.path.insert(0, str(_ROOT))
    return {_name(file): _first_line(file) for file in sorted(folder.glob("*/bench_*.py"), key=_name)}


def _name(file: Path) -> str:
    return file.stem.removeprefix("bench_")


def _first_line(path: Path) -> str:
    for line in path.read_text("utf-8").splitlines():
        if line.strip():
            return line.strip().strip('"')
    return ""


def _load(name: str) -> Any:
    (file,) = (_ROOT / "benchmarks").glob(f"*/bench_{name}.py")
    return importlib.import_module(f"benchmarks.{file.parent.name}.{file.stem}")


def _show(rows: list[dict[str, Any]]) -> None:
    """A case is a line of its own; its figures follow, so that eighty columns are enough."""
    met = {True: "yes", False: "no", None: ""}
    peers: dict[str, str] = {}
    case = ""
    out.print(f"{'':32}{'value':>17}{'peer':>12}{'ratio':>7}{'target':>8} met", style="bold")
    for r in rows:
        if r["case"] != case:
            case = r["case"]
            out.print(case, style="bold", soft_wrap=True)
        peer = ""
        if r["peer"] is not None:
            sign = peers.setdefault(r["peer"], f"[{len(peers) + 1}]")
            peer = sign if r["peer_value"] is None else f"{r['peer_value']:.4g} {sign}"
        ratio = "" if r["ratio"] is None else f"{r['ratio']:.3g}"
        target = (r["target"] or "").removeprefix("ratio ")
        figures = f"{r['value']:.4g} {r['unit']:8}".rjust(17) + f"{peer:>12}{ratio:>7}{target:>8}"
        colour = {True: "green", False: "red", None: "default"}[r["met"]]
        line = Text.assemble(f"  {r['metric']:30}{figures} ", (met[r["met"]], colour))
        line.rstrip()
        out.print(line, soft_wrap=True)
    for name, sign in peers.items():
        out.print(f"{sign} {name}", soft_wrap=True)
    if rows:
        out.print(f"on {rows[0]['machine']}; load {rows[0]['load']:g} at the start", soft_wrap=True)

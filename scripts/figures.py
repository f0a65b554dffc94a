"""Writes docs/performance.md from docs/figures.jsonl; runs benchmarks first: `python -m scripts.figures [--all | BENCH...]`.

docs/figures.jsonl holds what `vistel bench NAME --json` printed last, for each benchmark; one that is not run keeps its lines.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FIGURES = ROOT / "docs/figures.jsonl"
PAGE = ROOT / "docs/performance.md"
SUBJECTS = {
    "first": ("The first hour", "a-conference-on-one-machine"),
    "demo": ("A conference on one machine", "a-conference-on-one-machine"),
    "latency": ("From a hand to the eyes of the others", "a-conference-on-one-machine"),
    "render": ("Pictures", "a-conference-on-one-machine"),
    "console": ("The room in a browser", "a-conference-on-one-machine"),
    "guest": ("Guests", "a-conference-on-one-machine"),
    "world": ("The shared world", "a-conference-on-one-machine"),
    "interest": ("Who hears what of a room", "the-wire"),
    "join": ("Joining late", "the-wire"),
    "pipeline": ("The bus", "the-wire"),
    "apart": ("Sites apart", "the-wire"),
    "crowd": ("A crowd in one room", "the-wire"),
    "rooms": ("Many rooms", "the-wire"),
    "wire": ("The wire", "the-wire"),
    "motion": ("Motion", "motion"),
    "logs": ("Logs", "logs"),
    "posture": ("Posture", "posture"),
    "face": ("Faces and eyes", "faces-and-eyes"),
    "grasp": ("Taking hold", "taking-hold"),
    "audio": ("Voices", "voices"),
    "sync": ("Voices and pictures", "voices"),
    "speech": ("Spoken commands", "spoken-commands"),
    "figure": ("Figures and avatars", "figures"),
    "looks_human": ("Lifelike people", "lifelike-people"),
    "wrinkle": ("Wrinkles", "wrinkles"),
    "deform": ("Deformation", "deformation"),
    "gpu": ("Deformation on the graphics side", "on-the-graphics-side"),
    "field": ("Field", "field"),
    "trace": ("Ray tracing", "ray-tracing"),
    "scanline": ("Scanline pictures", "scanline-pictures"),
    "polygonise": ("Meshes", "meshes"),
}
"""Each benchmark's heading, in the order of the page, and its part of docs/performance-history.md."""
CALM = 1.5
"""A benchmark that begins under a higher load is marked: what else ran may have slowed it down."""
MARK = "†"
Line = dict[str, Any]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("benches", nargs="*", metavar="BENCH", help="benchmarks to run; none: only write the page")
    parser.add_argument("--all", action="store_true", help="run every benchmark")
    options = parser.parse_args()
    if unknown := set(options.benches) - set(SUBJECTS):
        sys.exit(f"figures: no such benchmark: {', '.join(sorted(unknown))}; there are {', '.join(SUBJECTS)}")
    names: list[str] = list(SUBJECTS) if options.all else options.benches
    failed = [name for name in names if not renewed(name)]
    PAGE.write_text(page(kept()), "utf-8")
    if failed:
        sys.exit(f"figures: nothing new of {', '.join(failed)}; their old lines stand")


def renewed(name: str) -> bool:
    """Whether a benchmark ran to its end; its lines then take the place of its old ones."""
    command = [sys.executable, "-m", "vistel_cli.main", "bench", name, "--json"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode == 0:
        keep(name, done.stdout)
    return done.returncode == 0


def keep(name: str, said: str) -> None:
    """What `vistel bench NAME --json` said takes the place of what is kept of it."""
    new = [json.loads(line) for line in said.splitlines()]
    lines = [line for line in kept() if line["bench"] != name] + new
    lines.sort(key=lambda line: list(SUBJECTS).index(line["bench"]))
    FIGURES.write_text("".join(json.dumps(line, ensure_ascii=False) + "\n" for line in lines), "utf-8")


def kept() -> list[Line]:
    """Every figure of docs/figures.jsonl."""
    return [json.loads(line) for line in FIGURES.read_text("utf-8").splitlines()]


def page(lines: Sequence[Line]) -> str:
    """The whole page, Markdown."""
    parts = "\n\n".join(_subject(name, [line for line in lines if line["bench"] == name]) for name in SUBJECTS)
    judged = [line for line in lines if line["met"] is not None]
    missed = [line for line in judged if not line["met"]]
    return f"""# Performance

<!-- Made by `python -m scripts.figures` from docs/figures.jsonl; do not edit. -->

Each part is what one benchmark measured last. `vistel bench NAME` measures it again on your machine; `make figures` measures all
and writes this page, `make figures BENCH="field deform"` only some. Where a peer is named, it was measured in the same run, in turn
with VISTEL, and the ratio is VISTEL's value to the peer's. How things are measured, why targets are missed, and older figures:
[history](performance-history.md).

{MARK}: more than {CALM:g} processes wanted a core when the benchmark began, so times may be longer than the code alone would take.

## What is missed

{len(judged) - len(missed)} of {len(judged)} targets are met.

{_missed(missed)}

{parts}
"""


def _missed(lines: Sequence[Line]) -> str:
    head = "| subject | case | figure | value | ratio | target |\n|---|---|---|--:|--:|---|"
    rows = [
        (_link(one), one["case"], one["metric"], _value(one), _ratios(same), one["target"])
        for same in _alike(lines)
        for one in same[:1]
    ]
    return _table(head, rows)


def _subject(name: str, lines: Sequence[Line]) -> str:
    title, past = SUBJECTS[name]
    about = f"## {title}\n\n{_sentence(name)} `vistel bench {name}`; [how and why](performance-history.md#{past})."
    if not lines:
        return f"{about}\n\nNot measured since the figures of the history."
    under = lines[0]
    where = f"{under['date']}, commit {under['commit']}, load {under['load']:g}{_mark(under)}, {under['machine']}."
    judged, others = ([one for one in lines if (one["target"] is not None) == wanted] for wanted in (True, False))
    more = f"\n\n<details><summary>Without a target</summary>\n\n{_figures(others)}\n\n</details>" if judged and others else ""
    return f"{about}\n{where}\n\n{_figures(judged or others)}{more}"


def _figures(lines: Sequence[Line]) -> str:
    head = "| case | figure | value | peer | ratio | target | met |\n|---|---|--:|---|--:|---|---|"
    rows: list[tuple[str, ...]] = []
    case = None
    for same in _alike(lines):
        one = same[0]
        peers = "; ".join(f"{_number(line['peer_value'])}, {line['peer']}" for line in same if line["peer_value"] is not None)
        met = {True: "yes", False: "**no**", None: ""}[one["met"]]
        shown = "" if one["case"] == case else one["case"]
        rows.append((shown, one["metric"], _value(one), peers, _ratios(same), one["target"] or "", met))
        case = one["case"]
    return _table(head, rows)


def _alike(lines: Sequence[Line]) -> Iterator[list[Line]]:
    """Lines of one value, which has several peers."""
    for _, same in groupby(lines, key=lambda line: [line[key] for key in ("bench", "case", "metric", "value", "target", "met")]):
        yield list(same)


def _table(head: str, rows: Sequence[Sequence[str]]) -> str:
    return "\n".join((head, *(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in rows)))


def _sentence(name: str) -> str:
    """What is measured: the first line of the benchmark."""
    (file,) = (ROOT / "benchmarks").glob(f"*/bench_{name}.py")
    return file.read_text("utf-8").splitlines()[0].strip('"')


def _link(line: Line) -> str:
    title = SUBJECTS[line["bench"]][0]
    return f"[{title}](#{title.lower().replace(' ', '-')}){_mark(line)}"


def _mark(line: Line) -> str:
    return f" {MARK}" if line["load"] > CALM else ""


def _value(line: Line) -> str:
    unit = "" if line["unit"] in ("", "1") else f" {line['unit']}"
    return _number(line["value"]) + unit


def _ratios(same: Sequence[Line]) -> str:
    return "; ".join(_number(line["ratio"]) for line in same if line["ratio"] is not None)


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


if __name__ == "__main__":
    main()

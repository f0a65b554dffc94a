"""Prints how well the house is kept: `python -m scripts.house`, or `--json` for one object per line.

Each figure is counted from the files that git knows, so that a clean checkout and a used one give the same.
"""

import argparse
import ast
import json
import re
import subprocess
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("vistel", "vistel_services", "vistel_sim", "vistel_cli")
SOURCES = {".py", ".ts", ".glsl"}
GENERATED = ("vistel/v1/",)
MOST_FILES = 25
"""More files than this in one folder are too many to find one by its name."""
SUGAR = {"shape", "combine", "attributes", "primitive"}
"""Modules of `vistel.implicit` that may know each other: operators on shapes, for a shape must know what `+` makes of it
(docs/architecture.md)."""
_KERNELS = re.compile(r"(^|_)kernels$")


@dataclass(frozen=True)
class Figure:
    """One number of the house. wanted: as text; met: None where nothing is wanted; where: the places that count."""

    name: str
    value: int
    wanted: str
    met: bool | None
    where: list[str]


def tracked() -> list[Path]:
    """Files that git knows and that are there, relative to the root, without generated ones."""
    out = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    return [Path(f) for f in out if not f.startswith(GENERATED) and (ROOT / f).is_file()]


def circles() -> list[str]:
    """Modules that import each other, and folders beside each other that do, wherever the imports stand: in functions and for
    types alone, too."""
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    direct = {m: graph.find_modules_directly_imported_by(m) for m in graph.modules}
    rings = [("", direct)] + [(f"{parent}: ", _beside(graph, parent, direct)) for parent in sorted(graph.modules)]
    return [where + " <-> ".join(sorted(ring)) for where, edges in rings for ring in _rings(edges) if not _sugar(ring)]


def _beside(graph: grimp.ImportGraph, parent: str, direct: Mapping[str, set[str]]) -> dict[str, set[str]]:
    """Which children of a package import which others of them, themselves or by what is in them. Those that are modules, not
    folders, are seen where modules are."""
    children = {child: {child, *graph.find_descendants(child)} for child in graph.find_children(parent)}
    owner = {module: child for child, inside in children.items() for module in inside}

    def used(child: str) -> set[str]:
        return {owner[o] for m in children[child] for o in direct[m] if o in owner} - {child}

    return {child: used(child) for child in children}


def _rings(edges: Mapping[str, set[str]]) -> list[frozenset[str]]:
    """Sets of nodes that reach each other."""
    reached = {node: _reached(edges, node) for node in edges}
    found = {frozenset({n, *(o for o in out if n in reached[o])}) for n, out in reached.items()}
    return sorted((ring for ring in found if len(ring) > 1), key=lambda ring: (-len(ring), min(ring)))


def _reached(edges: Mapping[str, set[str]], start: str) -> set[str]:
    seen: set[str] = set()
    left = [start]
    while left:
        new = edges.get(left.pop(), set()) - seen
        seen |= new
        left += new
    return seen


def _sugar(ring: frozenset[str]) -> bool:
    return all(m.rpartition(".")[0] == "vistel.implicit.graph" and m.rpartition(".")[2] in SUGAR for m in ring)


def crowded(files: list[Path]) -> list[str]:
    """Folders with too many files."""
    count = Counter(f.parent for f in files)
    return [f"{folder} ({n})" for folder, n in count.most_common() if n > MOST_FILES]


def undocumented(files: list[Path]) -> Iterator[str]:
    """Public modules, classes, functions and methods of the library without a docstring."""
    for file in files:
        if file.suffix == ".py" and file.parts[0] == "vistel":
            tree = ast.parse((ROOT / file).read_text("utf-8"))
            if tree.body and not ast.get_docstring(tree):
                yield str(file)
            yield from (f"{file}:{line} {name}" for line, name in _bare(tree))


def _bare(node: ast.Module | ast.ClassDef) -> Iterator[tuple[int, str]]:
    for each in node.body:
        if isinstance(each, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and not each.name.startswith("_"):
            names = {d.attr if isinstance(d, ast.Attribute) else getattr(d, "id", "") for d in each.decorator_list}
            if not ast.get_docstring(each) and not names & {"overload", "override", "setter"}:
                yield each.lineno, each.name
            if isinstance(each, ast.ClassDef):
                yield from _bare(each)


def marked(files: list[Path], mark: str) -> list[str]:
    """Lines of Python with this mark in a comment."""
    pattern = re.compile(rf"#.*\b{mark}")
    return [
        f"{file}:{number}"
        for file in files
        if file.suffix == ".py" and file != Path("scripts/house.py")
        for number, line in enumerate((ROOT / file).read_text("utf-8").splitlines(), 1)
        if pattern.search(line)
    ]


def crammed(files: list[Path]) -> list[str]:
    """Constants that share one line, and so a docstring, with others."""
    pattern = re.compile(r"^(_?[A-Z][A-Z0-9_]*, )+_?[A-Z][A-Z0-9_]* = ", re.MULTILINE)
    places = [f for f in files if f.suffix == ".py" and f.parts[0] in {"vistel", "services", "sim", "clients"}]
    return [f"{f}: {hit.group()}" for f in places for hit in pattern.finditer((ROOT / f).read_text("utf-8"))]


def unstrict(files: list[Path]) -> list[str]:
    """Files of the library that ask pyright for less than strict checks and hold no kernels."""
    lax = re.compile(r"^# pyright: basic", re.MULTILINE)
    library = (f for f in files if f.suffix == ".py" and f.parts[0] == "vistel" and not _KERNELS.search(f.stem))
    return [str(f) for f in library if lax.search((ROOT / f).read_text("utf-8"))]


def lines(files: list[Path]) -> int:
    return sum((ROOT / f).read_text("utf-8").count("\n") for f in files if f.suffix in SOURCES)


def figures() -> list[Figure]:
    files = tracked()
    code = [f for f in files if f.suffix in SOURCES]
    rings = circles()
    bare = list(undocumented(code))
    folders, lax = crowded(code), unstrict(code)
    shared = crammed(code)
    layout, ignored = marked(code, r"fmt: (skip|off)"), marked(code, "noqa")
    services = lines([f for f in code if f.parts[0] == "services"])
    whole = lines([f for f in code if f.parts[0] != "tests"])
    return [
        Figure("import circles", len(rings), "0", not rings, rings),
        Figure(f"folders over {MOST_FILES} files", len(folders), "0", not folders, folders),
        Figure("public definitions without docstring", len(bare), "0", not bare, bare),
        Figure("constants that share a line", len(shared), "0", not shared, shared),
        Figure("fmt: skip", len(layout), "<= 60", len(layout) <= 60, layout),
        Figure("noqa", len(ignored), "<= 40", len(ignored) <= 40, ignored),
        Figure("files outside strict types but kernels", len(lax), "0", not lax, lax),
        Figure("lines of services", services, "<= 10500", services <= 10_500, []),
        Figure("lines without tests", whole, "<= 123700", whole <= 123_700, []),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="one JSON object per figure, with the places that count")
    as_json = parser.parse_args().json
    for figure in figures():
        if as_json:
            print(json.dumps(asdict(figure), ensure_ascii=False))
        else:
            print(f"{figure.value:8d}  {figure.name} (wanted {figure.wanted}, {'met' if figure.met else 'missed'})")


if __name__ == "__main__":
    main()

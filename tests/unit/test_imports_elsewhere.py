"""What need not be Linux is not: what a module loads on Windows, and what that loads, is nothing that only Unix has."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
UNIX = frozenset(("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"))
SOURCES = {"vistel": "vistel", "vistel_services": "services/vistel_services", "vistel_sim": "sim/vistel_sim"}
SOURCES |= {"vistel_cli": "clients/cli/vistel_cli"}
PLACES = ("vistel", "vistel_cli.log", "vistel_cli.main", "vistel_sim.motion", "vistel_services.world", "vistel_services.posture")
PLACES += ("vistel_services.renderer", "vistel_services.console", "vistel_services.pointer")
"""Library, replay, films, console and guests."""
NEED_UNIX = ("vistel_sim.ports.pty_port", "vistel_sim.microphone", "vistel_services.delay.client")
"""Pseudo-terminals, pipes and serial lines: Unix alone has them."""


def file_of(module: str) -> Path | None:
    """The file of a module of ours; None for others and for what is none."""
    root, _, rest = module.partition(".")
    if root not in SOURCES:
        return None
    path = ROOT / SOURCES[root] / rest.replace(".", "/")
    files = (path / "__init__.py", path.with_suffix(".py"))
    return next((f for f in files if f.is_file()), None)


def modules() -> Iterator[str]:
    for root, folder in SOURCES.items():
        for path in (ROOT / folder).rglob("*.py"):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            yield ".".join((root, *(parts[:-1] if parts[-1] == "__init__" else parts)))


def on_windows(test: ast.expr) -> bool | None:
    """What a condition at the top of a module is there; None: nobody knows."""
    text = ast.unparse(test)
    known = {"TYPE_CHECKING": False, "sys.platform == 'win32'": True, "sys.platform != 'win32'": False}
    return (known | {"sys.platform == 'linux'": False, "sys.platform == 'darwin'": False}).get(text)


def loaded_at_once(body: list[ast.stmt]) -> Iterator[ast.Import | ast.ImportFrom]:
    """Imports that run when a module is loaded."""
    for node in body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif isinstance(node, ast.If):
            there = on_windows(node.test)
            yield from loaded_at_once([*(node.body if there is not False else []), *(node.orelse if there is not True else [])])
        elif isinstance(node, ast.Try):
            may_fail = any("Import" in ast.unparse(h.type) for h in node.handlers if h.type is not None)
            yield from loaded_at_once([*([] if may_fail else node.body), *node.orelse, *node.finalbody])
        elif isinstance(node, ast.With | ast.ClassDef):
            yield from loaded_at_once(node.body)


@cache
def loads(module: str) -> frozenset[str]:
    """Modules that loading `module` loads at once, with the packages they are in."""
    path = file_of(module)
    if path is None:
        return frozenset()
    found = {module.rpartition(".")[0]}
    for node in loaded_at_once(ast.parse(path.read_text("utf-8")).body):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif node.module is not None:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return frozenset(name for name in found if name)


def way_to_unix(module: str) -> list[str]:
    """The shortest way from a module to one that only Unix has; empty: there is none."""
    before: dict[str, str] = {module: ""}
    waiting = [module]
    for name in waiting:
        if name.partition(".")[0] in UNIX:
            way = [name]
            while before[way[-1]]:
                way.append(before[way[-1]])
            return way[::-1]
        fresh = [found for found in sorted(loads(name)) if found not in before]
        before |= dict.fromkeys(fresh, name)
        waiting += fresh
    return []


def test_library_replay_films_console_and_guests_load_nothing_that_only_unix_has() -> None:
    asked = [m for m in modules() if any(m == p or m.startswith(f"{p}.") for p in PLACES)]
    assert len(asked) > 500
    assert [" -> ".join(way) for way in map(way_to_unix, asked) if way] == []


def test_the_ways_are_found_where_there_are_some() -> None:
    for module in NEED_UNIX:
        assert way_to_unix(module), module
    assert way_to_unix("vistel_sim.device")[1:-1] == ["vistel_sim.ports.pty_port"]

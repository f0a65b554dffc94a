"""No task fails unseen: what nobody awaits is started by vistel/wire/background.py."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BACKGROUND = ROOT / "vistel/wire/background.py"


def bare_tasks(tree: ast.AST) -> Iterator[ast.Call]:
    """Calls that start a task or work on a thread, other than in a task group, whose result may go unseen."""
    groups = {
        item.optional_vars.id
        for node in ast.walk(tree)
        if isinstance(node, ast.AsyncWith)
        for item in node.items
        if isinstance(item.optional_vars, ast.Name) and "TaskGroup" in ast.unparse(item.context_expr)
    }
    awaited = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Await)}
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute | ast.Name):
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id
        owner = ast.unparse(node.func.value) if isinstance(node.func, ast.Attribute) else ""
        if (name in ("create_task", "ensure_future") and owner not in groups) or (
            name == "run_in_executor" and id(node) not in awaited
        ):
            yield node


def test_tasks_that_nobody_awaits_are_started_in_one_place() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{call.lineno}: {ast.unparse(call)}"
        for folder in ("vistel", "services", "sim", "clients/cli")
        for path in (ROOT / folder).rglob("*.py")
        if path != BACKGROUND
        for call in bare_tasks(ast.parse(path.read_text("utf-8")))
    ]
    assert found == []


def test_the_search_finds_what_it_is_for() -> None:
    text = """
async def one():
    asyncio.create_task(work())
    loop.create_task(work())
    asyncio.ensure_future(work())
    loop.run_in_executor(None, work)
    await loop.run_in_executor(None, work)
    async with asyncio.TaskGroup() as group:
        group.create_task(work())
"""
    assert [call.lineno for call in bare_tasks(ast.parse(text))] == [3, 4, 5, 6]

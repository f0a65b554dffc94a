"""Writes the reference page of the Python interface from docstrings and examples: `python -m scripts.python_reference`."""

import inspect
import re
import textwrap
from importlib import import_module
from pathlib import Path
from typing import Any

from vistel.arrays import F64

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/reference/python.md"
MODULES = ("vistel", "vistel.log", "vistel.figure", "vistel.render", "vistel.session", "vistel.testing.conformance")
"""Modules whose `__all__` is the public interface, beside `vistel.implicit`, which has a page of its own."""


def page() -> str:
    """The whole page, Markdown."""
    modules = "\n\n".join(_module(name) for name in MODULES)
    examples = "\n\n".join(_example(path) for path in sorted((ROOT / "examples").glob("[0-9][0-9]_*")))
    return f"""# The Python interface

<!-- Made by `python -m scripts.python_reference` from docstrings and examples/; do not edit. -->

What this page lists is public. So is [`vistel.implicit`](implicit.md), which has a page of its own. Everything else may change
from one version to the next.

{modules}

## Examples

Each runs as its first lines say.

{examples}
"""


def _module(name: str) -> str:
    module = import_module(name)
    first, *rest = inspect.getdoc(module).split("\n\n") if module.__doc__ else [""]  # pyright: ignore[reportOptionalMemberAccess]
    code = "\n\n".join(part for part in rest if part.startswith("    "))
    parts = [f"## `{name}`", first, *([f"```python\n{textwrap.dedent(code)}\n```"] if code else [])]
    for public in sorted(module.__all__):
        value = getattr(module, public)
        if not inspect.ismodule(value) and not public.startswith("__"):
            parts.append(_entry(public, value))
    return "\n\n".join(parts)


def _entry(name: str, value: Any) -> str:
    lines = [f"**`{name}{_signature(value)}`**", _text(value)]
    members: list[str] = []
    if inspect.isclass(value):
        for member, raw in vars(value).items():
            function = raw.fget if isinstance(raw, property) else raw
            if not member.startswith("_") and inspect.isfunction(function) and function.__doc__:
                called = "" if isinstance(raw, property) else _signature(function)
                members.append(f"- `{member}{called}`: {_text(function, ' ')}")
    return "\n\n".join(line for line in (*lines, "\n".join(members)) if line)


def _signature(value: Any) -> str:
    if inspect.isclass(value) and issubclass(value, Exception):
        return ""
    try:
        text = str(inspect.signature(value))
    except (TypeError, ValueError):
        return ""
    text = re.sub(r"ForwardRef\((.*?)\)(?=[,)])", r"\1", text) if "ForwardRef" in text else text
    text = re.sub(r"(: |-> )'(.*?)'(?=[,) ]|$)", r"\1\2", text)
    text = re.sub(r"\b(?:[a-z_]\w*\.)+(?=[A-Z])", "", text.replace(str(F64), "F64"))
    text = text.removesuffix(" -> None") if inspect.isclass(value) else text
    return re.sub(r"\((self|cls)(, )?", "(", text).replace(" = <factory>", " = ...")


def _text(value: Any, joint: str = "\n\n") -> str:
    doc = inspect.getdoc(value) or ""
    return joint.join(" ".join(part.split()) for part in doc.split("\n\n"))


def _example(path: Path) -> str:
    link = f"[`examples/{path.name}`](../../examples/{path.name})"
    if path.is_dir():
        return f"### {link}\n\nA package that brings a device of its own; [how to write one](../how-to/write-a-device-driver.md)."
    return f"### {link}\n\n```python\n{path.read_text('utf-8').rstrip()}\n```"


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")

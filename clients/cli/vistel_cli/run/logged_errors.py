"""What processes log as an error and somebody can mend, as lines for a person."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from vistel.session.log_files import LogFiles

_LINE = re.compile(r"\S+Z ERROR\s+(?P<node>\S+) \S+ event=(?P<event>\w+) (?P<fields>.*reason=.*)")
_FIELD = re.compile(r"""(\w+)=('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"|.*?)(?=\s\w+=|\s*$)""")
_FOR_PROGRAMMERS = ("task_failed", "message_not_written", "engine_failed", "parcel_refused", "asset_not_packed")
_AFTER = ("shown", "using", "mend")
"""Fields that stand behind the reason."""


class LoggedErrors:
    """Follows the logs of a run. Each error is told once, however often it is logged."""

    def __init__(self, folder: Path) -> None:
        """folder: where the processes' logs are."""
        self._files = LogFiles(folder)
        self._told: set[str] = set()

    def new(self) -> Iterator[str]:
        """Those logged since the last call, such as "tokyo/capture: avatar refused (aiko, me.usda): no file; shown: stand-in"."""
        for _, lines in self._files.new():
            for line in lines:
                text = told(line)
                if text and text not in self._told:
                    self._told.add(text)
                    yield text


def told(line: str) -> str:
    """A line of a log for a person; empty if it is no error that a person can mend."""
    found = _LINE.match(line)
    if found is None or found["event"] in _FOR_PROGRAMMERS:
        return ""
    fields = {key: _plain(value) for key, value in _FIELD.findall(found["fields"])}
    what = [value for key, value in fields.items() if list(fields).index(key) < list(fields).index("reason")]
    subject = f" ({', '.join(what)})" if what else ""
    after = [f"{key}: {fields[key]}" for key in _AFTER if key in fields]
    return "; ".join([f"{found['node']}: {found['event'].replace('_', ' ')}{subject}: {fields['reason']}", *after])


def last_line(path: Path) -> str:
    """The last line of a file; empty where there is none."""
    with suppress(OSError):
        return next(reversed(path.read_text("utf-8", "replace").splitlines()), "")
    return ""


def _plain(value: str) -> str:
    """A value as it was before it was written with quotation marks."""
    if value[:1] in ("'", '"'):
        with suppress(ValueError, SyntaxError):
            return str(ast.literal_eval(value))
    return value

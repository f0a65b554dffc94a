"""Reading a TOML file and checking it by a model."""

import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from vistel.toml.faults import Fault, faults_of
from vistel.toml.places import Place, lines_of, named

M = TypeVar("M", bound=BaseModel)
_MENDS = {
    "Invalid value": '; text stands in quotes, "like this"',
    "Illegal character '\\n'": "; close the text with a quotation mark",
    "Unterminated string": "; close the text with a quotation mark",
    "Unescaped '\\' in a string": "; write / for \\ in names of files",
    "Cannot overwrite a value": "; this key stands here twice",
    "Unclosed array": "; close the list with ]",
}
"""How to mend what tomllib says."""


@dataclass
class TomlFile:
    """The tables of a file, and the text that says on which line each key stands."""

    source: Path | str
    tables: Any
    """A mapping from text, if the file is to be of use."""
    text: str = ""
    """Empty: lines are not told."""
    _lines: dict[Place, int] = field(default_factory=dict[Place, int])

    def checked(self, model: type[M], error: type[Exception]) -> M:
        """The tables as `model`. Raises `error`, one line per fault."""
        try:
            return model.model_validate(self.tables)
        except ValidationError as e:
            raise error(self.described(faults_of(e, model, self.tables))) from e

    def described(self, faults: Iterable[Fault | str]) -> str:
        """One line for each fault: FILE:LINE: KEY: what was expected. A fault that is text begins with its key."""
        return "\n".join(dict.fromkeys(self._described(f) for f in faults))

    def _described(self, fault: Fault | str) -> str:
        fault = Fault((), fault) if isinstance(fault, str) else fault
        line = self.line(fault.place, fault.text)
        return f"{self.source}{f':{line}' if line else ''}: {fault}"

    def line(self, place: Place, text: str = "") -> int | None:
        """The line of a place, or of the nearest thing round it; more exactly, of the key with which `text` begins."""
        if not self.text or not isinstance(self.source, Path):  # in what is no file nobody counts lines
            return None
        self._lines = self._lines or lines_of(self.text)
        key = named(text)
        for whole in ((*place, *key), key):
            for length in range(len(whole), 0, -1):
                if whole[:length] in self._lines:
                    return self._lines[whole[:length]]
        return None


def read(path: Path, error: type[Exception]) -> TomlFile:
    """The tables of a file. Raises `error`, one line that names the file."""
    try:
        return parsed(path.read_text("utf-8-sig"), path, error)  # some editors begin a file with a mark
    except OSError as e:
        raise error(f"{path}: cannot be read: {e.strerror or e}") from e
    except UnicodeDecodeError as e:
        line = e.object[: e.start].count(b"\n") + 1
        raise error(f"{path}:{line}: is no UTF-8 text; save the file as UTF-8") from e


def parsed(text: str, source: Path | str, error: type[Exception]) -> TomlFile:
    """The tables of a text. Raises `error`, one line that names `source`."""
    try:
        return TomlFile(source, tomllib.loads(text), text)
    except tomllib.TOMLDecodeError as e:
        at = re.fullmatch(r"(.*) \(at (?:line (\d+), (column \d+)|end of document)\)", str(e), re.S)
        if at and isinstance(source, Path):
            line, where = at[2] or text.count("\n") + 1, at[3] or "at its end"
            raise error(f"{source}:{line}: not valid TOML: {at[1]} ({where}){_MENDS.get(at[1], '')}") from e
        raise error(f"{source}: not valid TOML: {e}") from e
    except RecursionError as e:
        raise error(f"{source}: not valid TOML: nested too deep") from e

"""Commands whose modules are imported when they are called, so that `vistel --help` imports none of them."""

import re
import signal
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.exceptions import Abort, TyperException

from vistel_cli.plain_values import take_plain_values
from vistel_cli.terminal import FAILED


@dataclass(frozen=True)
class Lazy:
    """A command that is not imported yet. where: "module:name" of a function or of a `typer.Typer`; panel: its heading in the list
    of commands; line: what that list says of a `typer.Typer`, and its help if it has none; a function says it itself."""

    where: str
    panel: str | None = None
    line: str = ""

    def load(self, name: str) -> Any:
        """The command, called `name`. Imports its module."""
        from vistel_cli.inputs import guarded
        from vistel_cli.waiting import waiting

        module, attribute = self.where.split(":")
        with waiting(f"loading {name}"), interruptible():
            found = getattr(import_module(module), attribute)
        if isinstance(found, typer.Typer):
            group = typer.main.get_group(found)
            group.name, group.help = name, group.help or self.line
            return _tuned(guarded(group))
        alone = typer.Typer(add_completion=False, rich_markup_mode="rich")
        alone.command(name)(found)
        return _tuned(guarded(typer.main.get_command(alone)))

    def first_line(self) -> str:
        """`line`, else the beginning of the function's docstring, read from the source: an import may take a second."""
        if self.line:
            return self.line
        module, attribute = self.where.split(":")
        spec = find_spec(module)
        source = Path(spec.origin).read_text("utf-8") if spec and spec.origin else ""
        found = re.search(rf'^def {attribute}\(.*?\n    """(.*?)(?:\n\n|""")', source, re.DOTALL | re.MULTILINE)
        return " ".join(found[1].split()) if found else ""


@contextmanager
def interruptible() -> Iterator[None]:
    """Ctrl-C within the block ends the command, also where a module that is being imported loses it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []

    def interrupt(number: int, _: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if came:
        raise KeyboardInterrupt


def lazy_group(commands: Mapping[str, Lazy]) -> type[TyperGroup]:
    """The class of a group with `commands` after those that it has: `typer.Typer(cls=lazy_group({...}))`."""

    class LazyGroup(TyperGroup):
        """A group that imports a command when it is called."""

        def __init__(self, **given: Any) -> None:
            super().__init__(**given)
            _tuned(self)
            self._loaded: dict[str, Any] = {}
            for name, lazy in commands.items():
                self.add_command(TyperCommand(name, rich_help_panel=lazy.panel))

        def list_commands(self, ctx: Any) -> list[str]:
            for name, lazy in commands.items():
                self.commands[name].help = lazy.first_line()
            return super().list_commands(ctx)

        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            name, command, rest = super().resolve_command(ctx, args)
            return name, self.loaded(name) if name else command, rest

        def main(self, *words: Any, standalone_mode: bool = True, **given: Any) -> Any:
            """As of any group; what the words of a command line lack or have too much is told in one line, not in a box."""
            if not standalone_mode:
                return super().main(*words, standalone_mode=False, **given)
            try:
                code = super().main(*words, standalone_mode=False, **given)
            except TyperException as e:
                from vistel_cli.usage import tell

                code = tell(e)
            except Abort:  # the input ended before a question was answered
                code = FAILED
            sys.exit(code)

        def loaded(self, name: str) -> Any:
            """The command of that name, imported once."""
            if name not in commands:
                return self.commands[name]
            if name not in self._loaded:
                self._loaded[name] = commands[name].load(name)
            return self._loaded[name]

    return LazyGroup


def _tuned(command: Any) -> Any:
    """The command, or the group: a flag takes no value, and help shows no type of it; what needs no conversion is not converted."""
    for option in (*command.params, command.get_help_option(typer.Context(command))):
        if getattr(option, "is_flag", False):
            option.metavar = ""
        take_plain_values(option)
    for inner in getattr(command, "commands", {}).values():
        _tuned(inner)
    return command


def every_command(group: Any, path: str) -> Iterator[tuple[str, Any]]:
    """The group and all commands below it, imported, with their words, such as "vistel log cut"."""
    yield path, group
    for name, command in getattr(group, "commands", {}).items():
        yield from every_command(group.loaded(name) if hasattr(group, "loaded") else command, f"{path} {name}")

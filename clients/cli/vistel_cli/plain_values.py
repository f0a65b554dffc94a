"""Words and defaults are taken as they are: pydantic, by which typer converts all values, takes a fifth of a second to load."""

from dataclasses import dataclass
from typing import Any

from typer.core import build_runtime_param  # pyright: ignore[reportPrivateImportUsage]  the module has no public name for it

NUMBERS = (int, float)


@dataclass(frozen=True)
class PlainValue:
    """How a parameter's value is converted: by typer, but only where there is something to convert."""

    typers: Any

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """The value of `param`. Raises typer's BadParameter."""
        several = param.multiple or param.nargs == -1
        if value is None:
            return () if several else None
        if self.typers.parameter_info.parser is None and _is_plain(value, self.typers.annotation, param.default):
            return list(value) if several else value
        return build_runtime_param(self.typers).coerce(value, param=param, ctx=ctx)


def _is_plain(value: Any, annotation: Any, default: Any) -> bool:
    if annotation == list[str]:
        return isinstance(value, list | tuple) and all(type(word) is str for word in value)
    return (annotation is str and type(value) is str) or (annotation in NUMBERS and type(value) is annotation and value == default)


def take_plain_values(parameter: Any) -> None:
    """Of an option or argument, which may be None."""
    if hasattr(parameter, "type_descriptor"):
        parameter._runtime_param = PlainValue(parameter.type_descriptor)  # nothing public sets it

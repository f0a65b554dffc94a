"""A command line that no command takes is told in one line."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import Any, get_args

from vistel_cli.terminal import USAGE, print_error

_TYPES = {int: "a whole number", float: "a number"}


def tell(error: Any) -> int:
    """Says what is wrong with the words of a command line. error: Typer's. Returns the exit code."""
    if type(error).__name__ == "NoArgsIsHelpError":  # the help is printed already
        return USAGE
    asked = getattr(error, "ctx", None)
    if len(guesses := getattr(error, "possibilities", None) or []) > 1:
        error.possibilities = get_close_matches(error.option_name, guesses, n=1, cutoff=0.0)
    text = _of_a_value(error) or _in_our_words(error.format_message())
    print_error(f"{text}; `{asked.command_path} --help` shows what it takes" if asked else text)
    return USAGE


def _of_a_value(error: Any) -> str:
    """What a value is and was expected to be; empty where no value is wrong."""
    option = getattr(error, "param", None)
    if option is None or type(error).__name__ != "BadParameter":
        return ""
    name = option.opts[-1] if option.opts[-1].startswith("-") else option.name.upper()
    kinds = (option.type_descriptor.annotation, *get_args(option.type_descriptor.annotation))
    what = next((_TYPES[kind] for kind in kinds if kind in _TYPES), None)
    if what is None:
        return f"{name}: {error.message.removeprefix('Value error, ').rstrip('.')}"
    if option.min is not None:
        what += f" from {option.min:g} to {option.max:g}" if option.max is not None else f", at least {option.min:g}"
    return f"{name}: expected {what}"


def _in_our_words(text: str) -> str:
    text = re.sub(r" \(Possible options?: (.*)\)", r"; did you mean \1?", " ".join(text.split()).rstrip("."))
    if meant := re.search(r"\.? Did you mean (?:one of:? )?(.*)\?$", text):
        words = meant[1].replace("'", "").replace(", ", " or ")
        text = f"{text[: meant.start()]}; did you mean {words}?"
    return text[:1].lower() + text[1:]

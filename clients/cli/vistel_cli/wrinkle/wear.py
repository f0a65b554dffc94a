"""`vistel wrinkle wear`: puts sets of wrinkles into an avatar's file."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from vistel_cli.avatar.files import Json, busy, check_output, load, report, save
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import GLTF, USD, WRINKLES
from vistel_cli.overwriting import Force, out_file
from vistel_cli.terminal import FAILED, USAGE, err, fail

if TYPE_CHECKING:
    from vistel.figure.avatar.avatar import Avatar
    from vistel.wrinkle.wrinkle_sets import WrinkleSet


def wear(
    avatar: Annotated[Path, Takes(USD, GLTF), typer.Argument(help="The avatar file: USD, or GLB or VRM that VISTEL wrote.")],
    sets: Annotated[
        list[str] | None,
        Takes(WRINKLES, names=True),
        typer.Argument(help="shirt, trousers, face, hands, or files of sets (.toml)."),
    ] = None,
    output: Annotated[Path | None, out_file("Avatar file to write; default: the same file.")] = None,
    off: Annotated[bool, typer.Option("--off", help="Remove all sets.")] = False,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Put sets of wrinkles into an avatar's file. Without sets, show its present ones and their regions.

    [bold]Examples[/bold]

      vistel wrinkle wear me.usda shirt trousers face

      vistel wrinkle wear me.usda
    """
    target = avatar if output is None else output
    changes = bool(sets) or off
    if sets and off:
        fail("--off: expected no sets beside it", USAGE)
    if changes:
        check_output(target)
    elif output is not None:
        fail("nothing to write: name sets to wear, or --off", USAGE)
    who = load(avatar)
    text, worn = _said(who, avatar, sets or [], off)
    facts: dict[str, Any] = {"avatar": str(avatar), "sets": len(worn)}
    if worn:
        with busy("looking where they fit", not as_json):
            facts |= _fitted(who, worn)
        for region, reason in facts["without"].items():
            err.print(Text.assemble((region, "yellow"), f": no wrinkles: {reason}"), soft_wrap=True)
        if changes and not facts["regions"]:
            fail(f"{avatar}: none of them fit; nothing is written", FAILED)
    if changes:
        save(replace(who, wrinkles=text), target, not as_json)
        facts["output"] = str(target)
    report(as_json, facts if as_json else {k: v for k, v in facts.items() if k != "without"})


def _said(who: Avatar, path: Path, names: list[str], off: bool) -> tuple[str, list[WrinkleSet]]:
    """The text to keep and its sets. Ends the command with one line when they cannot be read."""
    from vistel.wrinkle.errors import WrinkleError  # - the mathematics take long to load
    from vistel.wrinkle.sets_text import sets_text
    from vistel.wrinkle.wrinkle_sets import sets_in, wrinkle_sets

    try:
        if names:
            worn = wrinkle_sets(names)
            return sets_text(worn), worn
        return "", [] if off or not who.wrinkles else sets_in(who.wrinkles, f"{path}: wrinkles")
    except WrinkleError as fault:
        fail(str(fault))


def _fitted(who: Avatar, worn: list[WrinkleSet]) -> dict[str, Any]:
    """Regions with sets, and the reason for each region without."""
    from vistel.wrinkle.dressing import dressed
    from vistel.wrinkle.worn import Worn
    from vistel.wrinkle.wrinkle_sets import charted

    finest = replace(who, coarser=())
    made = dressed(finest, charted(worn))
    log = logging.getLogger("vistel.wrinkle")
    level = log.level
    log.setLevel(logging.ERROR)  # what does not fit is told by the caller
    try:
        fitted = Worn(made.avatar, worn, made.charts)
    finally:
        log.setLevel(level)
    return {"regions": sorted({s.side + s.what.region.name for s in fitted.sets}), "without": fitted.left_out}

"""Prints what differs between two logs; used by `vistel replay --fast --against` and `vistel log diff`."""

from dataclasses import asdict
from typing import Any

from rich.table import Column, Table
from rich.text import Text

from vistel.log.compare import Comparison, JointDifference, Limits
from vistel_cli.terminal import out

SHOWN = 12
"""Rows of the table for each participant; more tell nothing new: the joints below a turned one are all elsewhere."""


def comparison_json(found: Comparison, limits: Limits) -> dict[str, Any]:
    """The comparison as JSON-ready data, with the limits and a line for everything beyond them."""
    return asdict(found) | {"limits": asdict(limits), "over": found.over(limits)}


def print_comparison(found: Comparison, limits: Limits) -> None:
    """How much was compared; tables of joints, contacts and grasps beyond the limits; commands that were answered otherwise."""
    for p in found.postures:
        alone = f", {p.only_first} only in the first, {p.only_second} only in the second" if p.only_first + p.only_second else ""
        out.print(f"{p.participant}: {p.compared} postures compared{alone}")
    _print_joints(found, limits)
    _print_spans(found, limits)
    for answer in found.answers:
        said = f"{answer.first or 'no answer'}; then {answer.second or 'no answer'}"
        out.print(f"command {answer.command} of {answer.participant}: {said}", soft_wrap=True)
    worst = max(found.joints, key=lambda j: j.degrees, default=None)
    far = max(found.joints, key=lambda j: j.mm, default=None)
    most = f"joints differ by up to {worst.degrees:.2f}°, {far.mm:.1f} mm; " if worst and far else ""
    counts = {"contact": len(found.contacts), "grasp": len(found.grasps), "command": found.commands}
    spans = ", ".join(f"{count} {what}{'' if count == 1 else 's'}" for what, count in counts.items())
    over = len(found.over(limits))
    verdict = (f"{over} beyond the limits", "red") if over else ("all within the limits", "green")
    out.print(Text.assemble(f"{found.seconds:.1f} s compared: {most}{spans}: ", verdict), soft_wrap=True)


def _print_joints(found: Comparison, limits: Limits) -> None:
    """Joints that turn otherwise, the most first; of others, carried along by them, how many are elsewhere."""
    table = _table("joint", "degrees", "at most", "mm", "at most")
    notes: list[str] = []
    for who in dict.fromkeys(j.participant for j in found.joints):
        own = [j for j in found.joints if j.participant == who]
        turned = sorted((j for j in own if j.degrees > limits.degrees), key=lambda j: -j.degrees)
        carried = sorted((j for j in own if j.degrees <= limits.degrees and j.mm > limits.mm), key=lambda j: -j.mm)
        for j in turned[:SHOWN] or carried[:1]:
            table.add_row(f"{who} {j.joint}", *_figures(j))
        if len(turned) > SHOWN:
            notes.append(f"{who}: {len(turned) - SHOWN} more joints turn otherwise, by {turned[SHOWN].degrees:.2f}° and less")
        if carried:
            most = f"{carried[0].mm:.1f} mm ({carried[0].joint})"
            counted = "1 joint turns alike but is" if len(carried) == 1 else f"{len(carried)} joints turn alike but are"
            notes.append(f"{who}: {counted} elsewhere, by up to {most}")
    if table.row_count:
        out.print(table)
    for note in notes:
        out.print(note, soft_wrap=True)


def _figures(j: JointDifference) -> tuple[str, ...]:
    return f"{j.degrees:.2f}", f"{j.most_degrees:.2f}", f"{j.mm:.1f}", f"{j.most_mm:.1f}"


def _print_spans(found: Comparison, limits: Limits) -> None:
    table = _table("contact or grasp", "first, s", "second, s", "apart, s")
    for span in (*found.contacts, *found.grasps):
        if span.apart_s > limits.apart_s:
            table.add_row(span.what, f"{span.first_s:.2f}", f"{span.second_s:.2f}", f"{span.apart_s:.2f}")
    if table.row_count:
        out.print(table)


def _table(*headings: str) -> Table:
    table = Table(*(Column(h, justify="right" if n else "left") for n, h in enumerate(headings)), box=None, padding=(0, 2, 0, 0))
    table.pad_edge = False
    return table

"""`vistel sim crowd`: a conference of many without devices, to see what it costs."""

from __future__ import annotations

import asyncio
import json
from typing import Annotated

import typer

from vistel_cli.run.crowd.load import CrowdLoad, measure
from vistel_cli.terminal import fail, out


def crowd(
    people: Annotated[int, typer.Option("-n", "--people", min=2, max=1000, help="How many take part.")] = 100,
    receive: Annotated[int | None, typer.Option(min=1, help="How many of them receive as sites do; default: all.")] = None,
    seconds: Annotated[float, typer.Option(min=1.0, help="How long it is measured, once the world runs.")] = 10.0,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object.")] = False,
) -> None:
    """Run a conference of many on this machine: a real router and world, participants that send motion and voices without devices,
    and one site that measures. Tells what each costs, and whether the senders themselves were the bottleneck.

    [bold]Example[/bold]

      vistel sim crowd -n 20
    """
    try:
        load = asyncio.run(measure(people, seconds, receive))
    except RuntimeError as e:
        fail(f"crowd: {e}")
    if as_json:
        out.print_json(json.dumps(_told(load)))
    else:
        for name, value in _told(load).items():
            out.print(f"{name.replace('_', ' '):36} {value}", markup=False, highlight=False)
    if load.void:
        fail(f"crowd: the figures say nothing: {load.void}; run it with less beside it, or with fewer people")


def _told(load: CrowdLoad) -> dict[str, float]:
    """The figures, named with their units."""
    figures = {
        "people": load.people,
        "router_cores": load.router_cores,
        "world_cores": load.world_cores,
        "sending_processes_cores": sum(load.sender_cores),
        "sent_late_p99_ms": load.sender_late_ms,
        "world_steps_per_s": load.steps_per_s,
        "motion_p50_ms": load.motion_part_ms(50),
        "motion_p99_ms": load.motion_part_ms(99),
        "received_messages_per_s": load.messages_per_s,
        "received_mbit_per_s": load.megabits_per_s,
        "received_in_full": load.in_full,
    }
    return {name: round(float(value), 2) for name, value in figures.items()}
